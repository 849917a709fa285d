using System;
using System.Collections.Generic;
using UnityEngine;

namespace Facefolds
{
    /// <summary>A layer in the scene: a mesh that is drawn twice, to depth and then its colour.</summary>
    internal sealed class LayerObject : IDisposable
    {
        public readonly MeshRenderer Renderer;
        readonly Mesh mesh;
        Texture2D maps; // of the reflection: all layers share it
        readonly Material[] materials;
        readonly Layer layer;

        public LayerObject(FacefoldsPlayer player, Transform head, Level level, int index, Mesh decoded)
        {
            layer = level.Layers[index];
            mesh = Turned(decoded);
            int[] queues = Drawing.Queues(index, level.Layers.Count);
            materials = new[]
            {
                Made(player.depthShader, "Facefolds/Layer Depth", queues[0]),
                Made(player.colourShader, "Facefolds/Layer Colour", queues[1]),
            };
            SetAll("_ColourPlace", Drawing.InPicture(layer.Rect, level.Colour, level.Width, level.Height));
            SetAll("_AlphaPlace", Drawing.InPicture(layer.Rect, level.Alpha, level.Width, level.Height));
            SetAll("_Rect", new[] { layer.Rect.X, layer.Rect.Y, layer.Rect.Width, layer.Rect.Height });
            foreach (Material material in materials)
            {
                material.SetFloat("_Slice", index);
                material.SetFloat("_Slices", level.Layers.Count);
                material.SetMatrix("_ToRoom", Matrix4x4.identity);
            }
            var thing = new GameObject("layer " + index);
            thing.transform.SetParent(head, false);
            thing.AddComponent<MeshFilter>().sharedMesh = mesh;
            Renderer = thing.AddComponent<MeshRenderer>();
            Renderer.sharedMaterials = materials; // more materials than submeshes: the mesh is drawn with each
            Renderer.shadowCastingMode = UnityEngine.Rendering.ShadowCastingMode.Off;
            Renderer.receiveShadows = false;
        }

        static Material Made(Shader shader, string name, int queue)
        {
            return new Material(shader != null ? shader : Shader.Find(name)) { renderQueue = queue };
        }

        static Mesh Turned(Mesh mesh)
        {
            Vector3[] points = mesh.vertices;
            for (int i = 0; i < points.Length; ++i) points[i] = new Vector3(-points[i].y, points[i].z, points[i].x); // Axes.ToUnity
            mesh.vertices = points;
            mesh.RecalculateBounds();
            return mesh;
        }

        /// <summary>Tells each layer the ball that holds them all: depth is divided among them.</summary>
        public static void Surround(List<LayerObject> layers)
        {
            Bounds all = layers[0].mesh.bounds;
            foreach (LayerObject layer in layers) all.Encapsulate(layer.mesh.bounds);
            foreach (LayerObject layer in layers)
            {
                layer.SetAll("_Ball", new double[] { all.center.x, all.center.y, all.center.z, all.extents.magnitude });
                layer.mesh.bounds = all; // all are culled together
            }
        }

        public void SetPicture(Texture picture) { foreach (Material material in materials) material.SetTexture("_Picture", picture); }

        public void SetReflection(Reflection one, Texture2D maps)
        {
            this.maps = maps;
            foreach (Material material in materials) material.SetTexture("_Reflection", maps);
            SetAll("_ReflectionSize", new double[] { one.Width, one.Height, 0, 0 });
            SetAll("_EnvironmentRect", Of(one.Environment));
            SetAll("_GlossRect", Of(one.Gloss));
            SetAll("_OffsetRect", Of(one.Offset));
            SetAll("_NormalsRect", Of(one.Normals));
            SetAll("_ReflectionScales", new[] { one.EnvironmentScale, one.GlossScale, one.OffsetScale, 0 });
            SetAll("_ToMaps", Drawing.ToMaps(layer.Window, one.Window));
        }

        static double[] Of(Rect4 rect) { return new[] { rect.X, rect.Y, rect.Width, rect.Height }; }

        /// <param name="rows">of the rotation from the meshes' own axes to the room's, both the asset's.</param>
        public void SetToRoom(double[][] rows)
        {
            Matrix4x4 matrix = Matrix4x4.identity;
            for (int i = 0; i < 3; ++i)
                for (int k = 0; k < 3; ++k) matrix[i, k] = (float)rows[i][k];
            foreach (Material material in materials) material.SetMatrix("_ToRoom", matrix);
        }

        void SetAll(string name, double[] v)
        {
            foreach (Material material in materials)
                material.SetVector(name, new Vector4((float)v[0], (float)v[1], (float)v[2], (float)v[3]));
        }

        public void Dispose()
        {
            UnityEngine.Object.Destroy(mesh);
            foreach (Material material in materials) UnityEngine.Object.Destroy(material);
            if (maps != null) UnityEngine.Object.Destroy(maps);
        }
    }
}
