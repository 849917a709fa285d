// What the package's shaders use of Unity's own includes, for a compiler of HLSL elsewhere.
#define UNITY_VERTEX_INPUT_INSTANCE_ID
#define UNITY_VERTEX_OUTPUT_STEREO
#define UNITY_SETUP_INSTANCE_ID(v)
#define UNITY_INITIALIZE_OUTPUT(type, name) name = (type)0
#define UNITY_INITIALIZE_VERTEX_OUTPUT_STEREO(o)
float4x4 unity_ObjectToWorld;
float4x4 unity_WorldToObject;
float4x4 unity_MatrixV;
float4x4 unity_MatrixP;
#define UNITY_MATRIX_V unity_MatrixV
#define UNITY_MATRIX_P unity_MatrixP
float3 _WorldSpaceCameraPos;
float4 UnityObjectToClipPos(float3 pos)
{
    return mul(unity_MatrixP, mul(unity_MatrixV, mul(unity_ObjectToWorld, float4(pos, 1.0))));
}
float LinearToGammaSpaceExact(float value) { return pow(value, 0.45); }
float GammaToLinearSpaceExact(float value) { return pow(value, 2.2); }
// DirectX 9's way to name a texture and its sampler in one, which Unity's compiler still takes.
SamplerState linear_clamp;
#define sampler2D Texture2D
#define tex2D(image, at) image.Sample(linear_clamp, at)
