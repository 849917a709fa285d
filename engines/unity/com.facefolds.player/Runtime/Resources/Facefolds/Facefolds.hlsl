// One layer: two looks into the same picture, colour and alpha. It is drawn twice, over the layers inside of it (render
// queues): to depth alone, then its colour where depth is no farther, so that only the nearest crossing of the sheet
// counts. Depth cannot be cleared between layers: each has a slice of the depth range of its own instead.
#ifndef FACEFOLDS_INCLUDED
#define FACEFOLDS_INCLUDED
#include "UnityCG.cginc"

sampler2D _Picture;
float4 _ColourPlace;   // (s, t) -> texture coordinates of the picture: times xy, plus zw
float4 _AlphaPlace;
float4 _Rect;          // zw: size of the layer's rectangle in texels
float4 _Ball;          // around all layers, in the object's axes: centre, radius
float _Slice;          // index of the layer, outermost 0
float _Slices;

sampler2D _Reflection;
float4 _ReflectionSize;     // width, height; 0: there is none
float4 _EnvironmentRect;    // x, y, width, height in pixels, y down
float4 _GlossRect;
float4 _OffsetRect;
float4 _NormalsRect;
float4 _ReflectionScales;   // environment, gloss, offset
float4 _ToMaps;             // (s, t) of the layer -> that of the maps: times xy, plus zw
float4x4 _ToRoom;           // from the meshes' own axes to those of the room, which the light is fixed to

struct Vertex
{
    float4 position : POSITION;
    float2 st : TEXCOORD0;
    UNITY_VERTEX_INPUT_INSTANCE_ID
};

struct Pixel
{
    float4 clip : SV_POSITION;
    float2 st : TEXCOORD0;
    float3 fromEye : TEXCOORD1; // in the asset's own axes: z up, the subject looks to +x
    UNITY_VERTEX_OUTPUT_STEREO
};

#if defined(UNITY_REVERSED_Z)
static const float2 DepthRange = float2(0, 1);
#elif defined(SHADER_API_GLCORE) || defined(SHADER_API_GLES) || defined(SHADER_API_GLES3)
static const float2 DepthRange = float2(-1, 1);
#else
static const float2 DepthRange = float2(0, 1);
#endif

// Of a place at z of the camera's axes (negative in front), as it is stored; in front of the eye the nearest.
float DeviceDepth(float z, float nearest)
{
    float4 clip = mul(UNITY_MATRIX_P, float4(0, 0, z, 1));
    return clip.w > 0 ? clamp(clip.z / clip.w, DepthRange.x, DepthRange.y) : nearest;
}

float3 ToAsset(float3 v) { return float3(v.z, -v.x, v.y); }

Pixel LayerVertex(Vertex v)
{
    Pixel o;
    UNITY_SETUP_INSTANCE_ID(v);
    UNITY_INITIALIZE_OUTPUT(Pixel, o);
    UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(o);
    o.st = v.st;
    float3 eye = mul(unity_WorldToObject, float4(_WorldSpaceCameraPos, 1)).xyz;
    o.fromEye = ToAsset(v.position.xyz - eye);
    float4 clip = UnityObjectToClipPos(v.position.xyz);
    float middle = mul(UNITY_MATRIX_V, mul(unity_ObjectToWorld, float4(_Ball.xyz, 1))).z;
    float reach = _Ball.w * length(mul((float3x3)unity_ObjectToWorld, float3(1, 0, 0)));
#if defined(UNITY_REVERSED_Z)
    float nearest = DepthRange.y;
#else
    float nearest = DepthRange.x;
#endif
    float near = DeviceDepth(middle + reach, nearest);
    float far = DeviceDepth(middle - reach, nearest);
    // From [near, far] into its slice: near + (slice (far - near) + depth - near) / slices.
    clip.z = (near + (_Slice * (far - near) - near) / _Slices) * clip.w + clip.z / _Slices;
    o.clip = clip;
    return o;
}

float2 Inside(float2 st, float2 size) { return clamp(st, 0.5 / size, 1 - 0.5 / size); }

// The stored value, also where reading has decoded it.
float3 Stored(float3 c)
{
#if defined(UNITY_COLORSPACE_GAMMA)
    return c;
#else
    return float3(LinearToGammaSpaceExact(c.r), LinearToGammaSpaceExact(c.g), LinearToGammaSpaceExact(c.b));
#endif
}

float3 ReadMap(float4 rect, float2 st)
{
    float2 place = rect.xy + Inside(st, rect.zw) * rect.zw;
    return tex2D(_Reflection, float2(place.x, _ReflectionSize.y - place.y) / _ReflectionSize.xy).rgb;
}

float3 Reflected(float2 st, float3 fromEye)
{
    float2 at = st * _ToMaps.xy + _ToMaps.zw;
    float3 normal = normalize(ReadMap(_NormalsRect, at) * 2 - 1);
    float3 along = normalize(fromEye);
    float3 r = mul((float3x3)_ToRoom, along - 2 * min(dot(along, normal), 0) * normal);
    float2 place = 0.5 + 0.5 * float2(r.y, -r.z) / sqrt(max(2 * (1 + r.x), 1e-6));
    float3 light = ReadMap(_EnvironmentRect, place) * _ReflectionScales.x;
    float gloss = ReadMap(_GlossRect, at).r * _ReflectionScales.y;
    return light * gloss - (ReadMap(_OffsetRect, at) * 2 - 1) * _ReflectionScales.z;
}

float4 LayerColour(Pixel i) : SV_Target
{
    float2 st = Inside(i.st, _Rect.zw);
    float3 colour = Stored(tex2D(_Picture, st * _ColourPlace.xy + _ColourPlace.zw).rgb);
    float alpha = Stored(tex2D(_Picture, st * _AlphaPlace.xy + _AlphaPlace.zw).rgb).r;
    if (_ReflectionSize.x > 0) colour = saturate(colour + Reflected(i.st, i.fromEye));
#if !defined(UNITY_COLORSPACE_GAMMA)
    colour = float3(GammaToLinearSpaceExact(colour.r), GammaToLinearSpaceExact(colour.g), GammaToLinearSpaceExact(colour.b));
#endif
    return float4(colour, alpha);
}

float4 LayerNothing(Pixel i) : SV_Target { return 0; }
#endif
