using System;
using System.Collections;
using System.Collections.Generic;
using UnityEngine;
using UnityEngine.Networking;
using UnityEngine.Video;

namespace Facefolds
{
    /// <summary>Plays an asset: give it the address of a folder, play. y is up, the subject looks along +z; a unit is
    /// about as far as the capture's cameras stood away. Use the colour space Gamma: see the package's README.</summary>
    [AddComponentMenu("Facefolds/Facefolds Player")]
    public sealed class FacefoldsPlayer : MonoBehaviour
    {
        [Tooltip("Of the asset: it holds manifest.json. A folder below StreamingAssets, a path, or http(s)://...")]
        public string folder = "";
        [Tooltip("Level of detail by its name; empty: the full one.")]
        public string level = "";
        public bool autoplay = true;
        public bool loop = true;
        [Tooltip("Holds a head that turns still; it performs.")]
        public bool still;
        public bool reflection = true;
        public Shader depthShader;
        public Shader colourShader;

        public event Action Ready;
        public event Action<int> FrameChanged;
        public event Action Finished;
        public event Action<string> Failed;

        /// <summary>Why nothing is shown, in words; null if all is well.</summary>
        public string Error { get; private set; }
        public int Frames { get { return shown == null ? 0 : shown.Frames; } }
        public int Frame { get; private set; }
        public double Fps { get { return shown == null ? 0 : shown.Fps; } }
        public bool IsReady { get; private set; }
        public bool Playing { get { return video != null && video.isPlaying; } }

        Manifest manifest;
        Level shown;
        VideoPlayer video;
        RenderTexture picture;
        Transform head;
        readonly List<LayerObject> layers = new List<LayerObject>();

        void Start() { if (folder != "") Load(folder); }

        /// <summary>Loads an asset and shows its first frame.</summary>
        public void Load(string from)
        {
            Clear();
            folder = from;
            StartCoroutine(Loading(AddressOf(from)));
        }

        public void Play()
        {
            if (!IsReady || Frames < 2) return;
            if (!loop && Frame == Frames - 1) Seek(0);
            video.isLooping = loop;
            video.Play();
        }

        public void Pause() { if (IsReady) video.Pause(); }

        /// <summary>Asks for a frame; FrameChanged tells when it is shown.</summary>
        public void Seek(int frame)
        {
            if (!IsReady) return;
            video.Pause();
            video.frame = Mathf.Clamp(frame, 0, Frames - 1);
        }

        public void SetLayerVisible(int index, bool visible) { layers[index].Renderer.enabled = visible; }

        IEnumerator Loading(string address)
        {
            string text = null;
            yield return Fetched(address + "manifest.json", request => text = request.downloadHandler.text);
            if (text == null) yield break;
            Video wanted = null;
            try
            {
                manifest = Manifest.Parse(text);
                shown = manifest.LevelOf(level);
                wanted = shown.Videos.Find(one => one.Codec == "h264" && one.Container == "mp4")
                    ?? shown.Videos.Find(one => one.Codec == "vp9");
                if (wanted == null) throw new FormatException("level " + shown.Name + " has no H.264 and no VP9 video");
            }
            catch (FormatException error) { Fail(address + "manifest.json: " + error.Message); }
            if (wanted == null) yield break;
            if (manifest.TrackFile != null)
                yield return Fetched(address + manifest.TrackFile, request => TakePoses(request.downloadHandler.data));
            if (Error != null) yield break;
            yield return LayersLoaded(address);
            if (Error != null) yield break;
            if (shown.Reflection != null && reflection)
                yield return Fetched(address + shown.Reflection.File, AddReflection);
            if (Error == null) Begin(address + wanted.File);
        }

        void TakePoses(byte[] bytes)
        {
            try { manifest.ReadTrack(bytes); }
            catch (FormatException error) { Fail(error.Message); }
        }

        IEnumerator LayersLoaded(string address)
        {
            var files = new Dictionary<string, byte[]>(); // of all layers together, or one of each
            head = new GameObject("head").transform;
            head.SetParent(transform, false);
            for (int index = 0; index < shown.Layers.Count && Error == null; ++index)
            {
                Layer layer = shown.Layers[index];
                string file = address + layer.Mesh;
                if (!files.ContainsKey(file))
                    yield return Fetched(file, request => files[file] = request.downloadHandler.data);
                if (Error != null) yield break;
                if (files[file].Length < (long)layer.Offset + layer.Bytes)
                {
                    Fail(file + " is cut off");
                    yield break;
                }
                var bytes = new byte[layer.Bytes];
                Array.Copy(files[file], layer.Offset, bytes, 0, layer.Bytes);
                // As it is stored: neither its axes nor its texture coordinates turned over.
                var decoding = Draco.DracoDecoder.DecodeMesh(bytes, Draco.DecodeSettings.None);
                while (!decoding.IsCompleted) yield return null;
                if (decoding.IsFaulted || decoding.Result == null) Fail(file + ": the mesh could not be decoded");
                else layers.Add(new LayerObject(this, head, shown, index, decoding.Result));
            }
            if (Error == null) LayerObject.Surround(layers);
        }

        void AddReflection(UnityWebRequest request)
        {
            var maps = new Texture2D(2, 2, TextureFormat.RGB24, false, true) { wrapMode = TextureWrapMode.Clamp };
            if (!maps.LoadImage(request.downloadHandler.data)) Fail(request.url + ": not a picture");
            else foreach (LayerObject layer in layers) layer.SetReflection(shown.Reflection, maps);
        }

        void Begin(string url)
        {
            picture = new RenderTexture(shown.Width, shown.Height, 0) { filterMode = FilterMode.Bilinear, useMipMap = false };
            foreach (LayerObject layer in layers) layer.SetPicture(picture);
            video = gameObject.AddComponent<VideoPlayer>();
            video.playOnAwake = false;
            video.source = VideoSource.Url;
            video.url = url;
            video.renderMode = VideoRenderMode.RenderTexture;
            video.targetTexture = picture;
            video.aspectRatio = VideoAspectRatio.Stretch;
            video.waitForFirstFrame = true;
            video.skipOnDrop = true;
            video.isLooping = loop;
            video.sendFrameReadyEvents = true;
            video.frameReady += (_, frame) => Show((int)frame);
            video.errorReceived += (_, message) => Fail(url + ": " + message);
            video.loopPointReached += _ => { if (Finished != null) Finished(); };
            video.prepareCompleted += _ => Prepared();
            video.Prepare();
        }

        void Prepared()
        {
            IsReady = true;
            if (autoplay && Frames > 1) Play();
            else
            {
                video.Play(); // a video that was never played shows nothing
                video.Pause();
            }
            if (Ready != null) Ready();
        }

        /// <summary>The picture of that frame is in the texture: the head goes where it stood then.</summary>
        void Show(int frame)
        {
            Frame = Mathf.Clamp(frame, 0, Frames - 1);
            if (manifest.Track.Count > 0)
            {
                Pose pose = manifest.Track[Frame];
                foreach (LayerObject layer in layers) layer.SetToRoom(Axes.Matrix(pose.Quaternion));
                double[] q = Axes.RotationToUnity(pose.Quaternion), t = pose.Translation;
                double[] p = Axes.ToUnity(t[0], t[1], t[2]);
                bool moves = !still;
                head.localRotation = moves ? new Quaternion((float)q[0], (float)q[1], (float)q[2], (float)q[3]) : Quaternion.identity;
                head.localPosition = moves ? new Vector3((float)p[0], (float)p[1], (float)p[2]) : Vector3.zero;
            }
            if (FrameChanged != null) FrameChanged(Frame);
        }

        IEnumerator Fetched(string url, Action<UnityWebRequest> use)
        {
            using (UnityWebRequest request = UnityWebRequest.Get(url))
            {
                yield return request.SendWebRequest();
                if (request.result == UnityWebRequest.Result.Success) use(request);
                else Fail(url + ": " + request.error);
            }
        }

        static string AddressOf(string folder)
        {
            string path = folder.Contains("://") || System.IO.Path.IsPathRooted(folder)
                ? folder : Application.streamingAssetsPath + "/" + folder;
            if (!path.Contains("://")) path = "file://" + (path.StartsWith("/") ? "" : "/") + path.Replace('\\', '/');
            return path.EndsWith("/") ? path : path + "/";
        }

        void Fail(string message)
        {
            Error = message;
            Debug.LogError("facefolds: " + message, this);
            if (Failed != null) Failed(message);
        }

        void Clear()
        {
            StopAllCoroutines();
            Error = null;
            IsReady = false;
            Frame = 0;
            shown = null;
            foreach (LayerObject layer in layers) layer.Dispose();
            layers.Clear();
            if (video != null) Destroy(video);
            if (head != null) Destroy(head.gameObject);
            if (picture != null) picture.Release();
            video = null;
            head = null;
            picture = null;
        }

        void OnDestroy() { Clear(); }
    }
}
