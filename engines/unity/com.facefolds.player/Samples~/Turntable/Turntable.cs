using UnityEngine;

namespace Facefolds.Samples
{
    /// <summary>Put it on an empty object of an empty scene and name an asset's folder: it makes the rest. Space plays,
    /// arrows step, dragging turns.</summary>
    public sealed class Turntable : MonoBehaviour
    {
        public string folder = "asset"; // below Assets/StreamingAssets
        public float distance = 1.1f;
        float azimuth, elevation;
        FacefoldsPlayer player;
        Camera eye;

        void Start()
        {
            player = gameObject.AddComponent<FacefoldsPlayer>();
            player.folder = folder;
            eye = new GameObject("eye").AddComponent<Camera>();
            eye.clearFlags = CameraClearFlags.SolidColor;
            eye.backgroundColor = new Color(0.086f, 0.094f, 0.114f);
            eye.fieldOfView = 30;
            eye.nearClipPlane = 0.01f;
        }

        void Update()
        {
            if (Input.GetMouseButton(0))
            {
                azimuth += 4 * Input.GetAxis("Mouse X");
                elevation = Mathf.Clamp(elevation - 4 * Input.GetAxis("Mouse Y"), -60, 60);
            }
            if (Input.GetKeyDown(KeyCode.Space)) { if (player.Playing) player.Pause(); else player.Play(); }
            if (Input.GetKeyDown(KeyCode.LeftArrow)) player.Seek(player.Frame - 1);
            if (Input.GetKeyDown(KeyCode.RightArrow)) player.Seek(player.Frame + 1);
            // The subject looks along +z: from before it, the camera looks along -z.
            Quaternion turn = Quaternion.Euler(elevation, 180 + azimuth, 0);
            eye.transform.rotation = turn;
            eye.transform.position = transform.position - distance * (turn * Vector3.forward);
        }
    }
}
