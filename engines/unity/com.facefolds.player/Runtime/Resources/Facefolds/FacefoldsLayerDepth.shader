// Without a render pipeline's name and with one pass without a light mode: the built-in pipeline and URP both draw it.
Shader "Facefolds/Layer Depth"
{
    Properties
    {
        [NoScaleOffset] _Picture ("Picture", 2D) = "black" {}
        [NoScaleOffset] _Reflection ("Reflection", 2D) = "black" {}
    }
    SubShader
    {
        Tags { "Queue" = "Transparent" "RenderType" = "Transparent" "IgnoreProjector" = "True" }
        Pass
        {
            Cull Off
            ZWrite On
            ZTest LEqual
            ColorMask 0
            HLSLPROGRAM
            #pragma target 3.0
            #pragma vertex LayerVertex
            #pragma fragment LayerNothing
            #include "Facefolds.hlsl"
            ENDHLSL
        }
    }
}
