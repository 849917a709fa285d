// What the Unity package uses of Unity 2021.3 and of com.unity.cloud.draco, with the signatures of their manuals and
// without any behaviour: enough to compile it where there is no Unity.
using System;
using System.Collections;
using System.Collections.Generic;
using System.Threading.Tasks;

namespace UnityEngine
{
    public class Object
    {
        public static void Destroy(Object thing) { }
        public static implicit operator bool(Object thing) { return thing != null; }
        public string name { get; set; }
    }
    public class Component : Object
    {
        public GameObject gameObject { get { return null; } }
        public Transform transform { get { return null; } }
    }
    public class Behaviour : Component { public bool enabled { get; set; } }
    public class MonoBehaviour : Behaviour
    {
        public Coroutine StartCoroutine(IEnumerator routine) { return null; }
        public void StopAllCoroutines() { }
    }
    public class YieldInstruction { }
    public sealed class Coroutine : YieldInstruction { }
    public class AsyncOperation : YieldInstruction { public bool isDone { get { return true; } } }
    public sealed class GameObject : Object
    {
        public GameObject(string name) { }
        public Transform transform { get { return null; } }
        public T AddComponent<T>() where T : Component { return null; }
    }
    public class Transform : Component
    {
        public void SetParent(Transform parent, bool worldPositionStays) { }
        public Vector3 localPosition { get; set; }
        public Quaternion localRotation { get; set; }
        public Vector3 position { get; set; }
        public Quaternion rotation { get; set; }
    }
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 zero { get { return new Vector3(); } }
        public static Vector3 forward { get { return new Vector3(0, 0, 1); } }
        public float magnitude { get { return 0; } }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return a; }
        public static Vector3 operator *(float a, Vector3 b) { return b; }
    }
    public struct Pose { } // Unity has one, too
    public struct Vector4 { public Vector4(float x, float y, float z, float w) { } }
    public struct Quaternion
    {
        public Quaternion(float x, float y, float z, float w) { }
        public static Quaternion identity { get { return new Quaternion(); } }
        public static Quaternion Euler(float x, float y, float z) { return identity; }
        public static Vector3 operator *(Quaternion rotation, Vector3 point) { return point; }
    }
    public struct Matrix4x4
    {
        public static Matrix4x4 identity { get { return new Matrix4x4(); } }
        public float this[int row, int column] { get { return 0; } set { } }
    }
    public struct Bounds
    {
        public Vector3 center { get; set; }
        public Vector3 extents { get; set; }
        public void Encapsulate(Bounds other) { }
    }
    public struct Color { public Color(float r, float g, float b) { } }
    public class Mesh : Object
    {
        public Vector3[] vertices { get; set; }
        public Bounds bounds { get; set; }
        public void RecalculateBounds() { }
    }
    public class Shader : Object { public static Shader Find(string name) { return null; } }
    public class Material : Object
    {
        public Material(Shader shader) { }
        public int renderQueue { get; set; }
        public void SetVector(string name, Vector4 value) { }
        public void SetFloat(string name, float value) { }
        public void SetMatrix(string name, Matrix4x4 value) { }
        public void SetTexture(string name, Texture value) { }
    }
    public class Renderer : Component
    {
        public bool enabled { get; set; }
        public Material[] sharedMaterials { get; set; }
        public Rendering.ShadowCastingMode shadowCastingMode { get; set; }
        public bool receiveShadows { get; set; }
    }
    public sealed class MeshRenderer : Renderer { }
    public sealed class MeshFilter : Component { public Mesh sharedMesh { get; set; } }
    public enum FilterMode { Point, Bilinear, Trilinear }
    public enum TextureWrapMode { Repeat, Clamp }
    public enum TextureFormat { RGB24 = 3 }
    public class Texture : Object
    {
        public FilterMode filterMode { get; set; }
        public TextureWrapMode wrapMode { get; set; }
    }
    public sealed class Texture2D : Texture
    {
        public Texture2D(int width, int height, TextureFormat format, bool mipChain, bool linear) { }
    }
    public static class ImageConversion { public static bool LoadImage(this Texture2D texture, byte[] data) { return true; } }
    public sealed class RenderTexture : Texture
    {
        public RenderTexture(int width, int height, int depth) { }
        public bool useMipMap { get; set; }
        public void Release() { }
    }
    public enum CameraClearFlags { Skybox = 1, SolidColor = 2 }
    public sealed class Camera : Behaviour
    {
        public CameraClearFlags clearFlags { get; set; }
        public Color backgroundColor { get; set; }
        public float fieldOfView { get; set; }
        public float nearClipPlane { get; set; }
    }
    public static class Mathf
    {
        public static int Clamp(int value, int min, int max) { return value; }
        public static float Clamp(float value, float min, float max) { return value; }
    }
    public static class Application { public static string streamingAssetsPath { get { return ""; } } }
    public static class Debug { public static void LogError(object message, Object context) { } }
    public enum KeyCode { Space = 32, RightArrow = 275, LeftArrow = 276 }
    public static class Input
    {
        public static bool GetMouseButton(int button) { return false; }
        public static float GetAxis(string axisName) { return 0; }
        public static bool GetKeyDown(KeyCode key) { return false; }
    }
    public sealed class TooltipAttribute : Attribute { public TooltipAttribute(string tooltip) { } }
    public sealed class AddComponentMenu : Attribute { public AddComponentMenu(string menuName) { } }
}

namespace UnityEngine.Rendering { public enum ShadowCastingMode { Off, On, TwoSided, ShadowsOnly } }

namespace UnityEngine.Networking
{
    public class DownloadHandler
    {
        public string text { get { return ""; } }
        public byte[] data { get { return null; } }
    }
    public sealed class UnityWebRequestAsyncOperation : AsyncOperation { }
    public class UnityWebRequest : IDisposable
    {
        public enum Result { InProgress, Success, ConnectionError, ProtocolError, DataProcessingError }
        public static UnityWebRequest Get(string uri) { return null; }
        public UnityWebRequestAsyncOperation SendWebRequest() { return null; }
        public Result result { get { return Result.Success; } }
        public string error { get { return ""; } }
        public string url { get; set; }
        public DownloadHandler downloadHandler { get; set; }
        public void Dispose() { }
    }
}

namespace UnityEngine.Video
{
    public enum VideoSource { VideoClip, Url }
    public enum VideoRenderMode { CameraFarPlane, CameraNearPlane, RenderTexture, MaterialOverride, APIOnly }
    public enum VideoAspectRatio { NoScaling, FitVertically, FitHorizontally, FitInside, FitOutside, Stretch }
    public sealed class VideoPlayer : Behaviour
    {
        public delegate void EventHandler(VideoPlayer source);
        public delegate void ErrorEventHandler(VideoPlayer source, string message);
        public delegate void FrameReadyEventHandler(VideoPlayer source, long frameIdx);
        public event ErrorEventHandler errorReceived { add { } remove { } }
        public event FrameReadyEventHandler frameReady { add { } remove { } }
        public event EventHandler loopPointReached { add { } remove { } }
        public event EventHandler prepareCompleted { add { } remove { } }
        public VideoSource source { get; set; }
        public string url { get; set; }
        public VideoRenderMode renderMode { get; set; }
        public RenderTexture targetTexture { get; set; }
        public VideoAspectRatio aspectRatio { get; set; }
        public bool playOnAwake { get; set; }
        public bool waitForFirstFrame { get; set; }
        public bool skipOnDrop { get; set; }
        public bool isLooping { get; set; }
        public bool sendFrameReadyEvents { get; set; }
        public bool isPlaying { get { return false; } }
        public long frame { get; set; }
        public void Prepare() { }
        public void Play() { }
        public void Pause() { }
    }
}

namespace Draco
{
    [Flags]
    public enum DecodeSettings { None = 0, RequireNormals = 1, RequireTangents = 2, ForceUnityVertexLayout = 4, ConvertSpace = 8, Default = ConvertSpace }
    public static class DracoDecoder
    {
        public static Task<UnityEngine.Mesh> DecodeMesh(byte[] encodedData, DecodeSettings decodeSettings) { return null; }
    }
}
