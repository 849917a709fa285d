// Without a render pipeline's name and with one pass without a light mode: the built-in pipeline and URP both draw it.
Shader "Facefolds/Layer Colour"
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
            ZWrite Off
            ZTest LEqual
            Blend SrcAlpha OneMinusSrcAlpha, One OneMinusSrcAlpha
            HLSLPROGRAM
            #pragma target 3.0
            #pragma vertex LayerVertex
            #pragma fragment LayerColour
            #include "Facefolds.hlsl"
            ENDHLSL
        }
    }
}
