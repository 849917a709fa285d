/**
 * Reads EXT_layered_volumetric_video with Babylon.js' loader; written from the extension's text.
 *
 *     import { registerLayeredVolumetricVideo } from "./babylon.js";
 *     registerLayeredVolumetricVideo();
 *     const result = await ImportMeshAsync("face.glb", scene);
 *     const [face] = scene.metadata.volumetricVideos; // face.video is the HTMLVideoElement; face.seek(frame), face.dispose()
 *
 * The video's sound, if it has one, is heard after `face.video.muted = false`, upon a click.
 *
 * Layers are blended as the page is shown, in stored values. They have the alpha indices 1 to N: what is transparent
 * elsewhere in the scene is drawn after them. For WebGL.
 */
import { Constants } from "@babylonjs/core/Engines/constants.js";
import { AnimationGroup } from "@babylonjs/core/Animations/animationGroup.js";
import { HtmlElementTexture } from "@babylonjs/core/Materials/Textures/htmlElementTexture.js";
import { ShaderMaterial } from "@babylonjs/core/Materials/shaderMaterial.js";
import { Matrix, Quaternion, Vector2, Vector3, Vector4 } from "@babylonjs/core/Maths/math.vector.js";
import { registerGLTFExtension } from "@babylonjs/loaders/glTF/2.0/glTFLoaderExtensionRegistry.js";
import { LAYER, NAME, STAYING, check, depths, follow, openVideo, released, seek, slice } from "./video.js";

const vertexSource = `
precision highp float;
invariant gl_Position;
attribute vec3 position;
attribute vec2 uv;
uniform mat4 world;
uniform mat4 viewProjection;
uniform vec2 depth; // of z and w: into the layer's slice
varying vec2 st;
varying vec3 point;
${STAYING}
void main() {
  st = uv;
  point = staying(position);
  gl_Position = viewProjection * (world * vec4(point, 1.0));
  gl_Position.z = depth.x * gl_Position.z + depth.y * gl_Position.w;
}`;
const fragmentSource = `
precision highp float;
varying vec2 st;
varying vec3 point;
${LAYER}
void main() { gl_FragColor = shown(st, point); }`;

/** Once, before the first file is loaded. */
export function registerLayeredVolumetricVideo() {
  registerGLTFExtension(NAME, true, (loader) => new LayeredVolumetricVideo(loader));
}

class LayeredVolumetricVideo {
  constructor(loader) {
    this.name = NAME;
    this.loader = loader;
    this.enabled = loader.isExtensionUsed(NAME);
    this.tracks = new Set();
    this.seen = new Set();
  }

  dispose() {
    this.loader = null;
  }

  /** In the place of a node's still; the still where something is damaged, or no video can be decoded. */
  loadNodeAsync(context, node, assign) {
    const said = node.extensions?.[NAME];
    if (!said || this.seen.has(node)) return null;
    this.seen.add(node);
    if (said.animation !== undefined) this.tracks.add(said.animation);
    return this.load(context, node, said, assign);
  }

  async load(context, node, said, assign) {
    const { loader } = this;
    const bytes = (index) => loader.loadBufferViewAsync(`/bufferViews/${index}`, loader.gltf.bufferViews[index]);
    const video = await check(said, bytes)
      .then(() => openVideo(loader.gltf, said, bytes))
      .catch((error) => void console.warn(error.message));
    if (!video) return loader.loadNodeAsync(context, node, assign);
    const still = node.mesh;
    node.mesh = said.mesh;
    const root = await loader.loadNodeAsync(context, node, assign);
    node.mesh = still;
    const maps = said.reflection && (await this.stored(`${context}/reflection`, said.reflection.texture));
    const track = said.animation === undefined ? {} : await this.track(loader.gltf.animations[said.animation], bytes);
    const face = new LayeredVideo(loader.babylonScene, root, node._primitiveBabylonMeshes, said, video, maps, track);
    const metadata = (loader.babylonScene.metadata ??= {});
    (metadata.volumetricVideos ??= []).push(face);
    return root;
  }

  /** The track follows the video: it is no group that plays. */
  loadAnimationAsync(context, { index }) {
    return this.tracks.has(index) ? Promise.resolve(new AnimationGroup("track", this.loader.babylonScene)) : null;
  }

  /** A texture whose codes are not turned into linear light. */
  async stored(context, index) {
    const texture = await this.loader.loadTextureInfoAsync(context, { index, nonColorData: true });
    texture.anisotropicFilteringLevel = 1; // bilinear, no more
    if (!texture.isReady()) await new Promise((done) => texture.onLoadObservable.addOnce(done));
    return texture;
  }

  async track({ channels, samplers }, bytes) {
    const found = {};
    for (const { sampler, target } of channels) {
      const { bufferView, byteOffset = 0, count, type } = this.loader.gltf.accessors[samplers[sampler].output];
      const view = await bytes(bufferView);
      const length = 4 * count * Number(type.slice(3));
      const start = view.byteOffset + byteOffset;
      found[target.path] = new Float32Array(view.buffer.slice(start, start + length));
    }
    return found;
  }
}

/** A node's layers, its video and its motion. */
class LayeredVideo {
  constructor(scene, node, meshes, said, video, maps, track) {
    Object.assign(this, { scene, node, meshes, said, video, maps, track, frame: 0 });
    this.strays = 0; // how far what stays may be from where the node takes it
    this.rate = said.frameRate[0] / said.frameRate[1];
    this.picture = new HtmlElementTexture(NAME, video, { scene });
    meshes.forEach((mesh, layer) => this.dress(mesh, layer));
    if (said.torso) this.stand();
    this.observer = scene.onBeforeCameraRenderObservable.add((camera) => this.prepare(camera));
    follow(video, this.rate, said.frames, (frame) => this.show(frame));
  }

  /** Stop at a frame; resolves when it can be drawn. @param {number} frame */
  async seek(frame) {
    await seek(this.video, this.rate, frame);
    this.show(frame);
  }

  /** The picture that the video has, with the head as it stood then. */
  show(frame) {
    this.frame = frame;
    this.picture.update();
    const { rotation, translation } = this.track;
    if (rotation) this.node.rotationQuaternion = Quaternion.FromArray(rotation, 4 * frame);
    if (translation) this.node.position = Vector3.FromArray(translation, 3 * frame);
    if (this.said.torso) this.stand();
  }

  /** Where what stays is, in the node's own axes. */
  stand() {
    const { rotation, translation } = this.said.torso;
    const { rotationQuaternion, position } = this.node;
    const own = Quaternion.FromArray(rotation);
    const rest = Matrix.Compose(Vector3.One(), own, Vector3.FromArray(translation));
    const now = Matrix.Compose(Vector3.One(), rotationQuaternion ?? Quaternion.Identity(), position);
    const stay = rest.multiply(now.invert()); // rows: the first is applied first
    const spheres = this.meshes.map((mesh) => mesh.getBoundingInfo().boundingSphere);
    const { center } = spheres[0];
    const radius = Math.max(...spheres.map((one) => Vector3.Distance(one.center, center) + one.radius));
    const turn = 2 * Math.acos(Math.min(1, Math.abs(Quaternion.Dot(own, rotationQuaternion ?? Quaternion.Identity()))));
    this.strays =
      Vector3.Distance(Vector3.TransformCoordinates(center, stay), center) + 2 * radius * Math.sin(turn / 2);
    for (const { material } of this.meshes) material.setMatrix("stay", stay);
  }

  dress(mesh, layer) {
    const { said, maps } = this;
    const uniforms = ["world", "viewProjection", "depth", "size", "rectangle", "origins", "torso", "band", "stay"];
    const gloss = ["mapsSize", "environment", "gloss", "offset", "normals", "scales", "toMaps", "eye", "turn"];
    const material = new ShaderMaterial(
      `layer ${layer}`,
      this.scene,
      { vertexSource, fragmentSource },
      {
        attributes: ["position", "uv"],
        uniforms: maps ? [...uniforms, ...gloss] : uniforms,
        samplers: maps ? ["picture", "maps"] : ["picture"],
        defines: maps ? ["#define REFLECTION"] : [],
        needAlphaBlending: true,
      },
    );
    material.backFaceCulling = false;
    material.needDepthPrePass = true;
    material.depthFunction = Constants.LEQUAL;
    material.setTexture("picture", this.picture);
    material.setVector2("size", new Vector2(said.width, said.height));
    material.setVector4("rectangle", new Vector4(...said.rectangles[layer]));
    const [[x, y], [ax, ay]] = [said.colorRectangle, said.alphaRectangle];
    material.setVector4("origins", new Vector4(x, y, ax, ay));
    const { normal = [0, 0, 0], offset = 0, band = 0 } = said.torso ?? {};
    material.setVector4("torso", new Vector4(...normal, offset)).setFloat("band", band);
    material.setMatrix("stay", Matrix.Identity());
    if (maps) this.polish(material, layer);
    mesh.material = material;
    mesh.alwaysSelectAsActiveMesh = said.torso !== undefined;
    mesh.alphaIndex = this.meshes.length - layer; // the innermost is drawn first
  }

  polish(material, layer) {
    const said = this.said.reflection;
    const { width, height } = this.maps.getSize();
    material.setTexture("maps", this.maps);
    material.setVector2("mapsSize", new Vector2(width, height));
    for (const name of ["environment", "gloss", "offset", "normals"])
      material.setVector4(name, new Vector4(...said[`${name}Rectangle`]));
    material.setVector3("scales", new Vector3(said.environmentScale, said.glossScale, said.offsetScale));
    material.setVector4("toMaps", new Vector4(...said.transforms[layer]));
  }

  /** What depends on the camera. */
  prepare(camera) {
    const spheres = this.meshes.map((mesh) => mesh.getBoundingInfo().boundingSphere);
    const centre = spheres[0].centerWorld;
    const far = spheres.map((one) => Vector3.Distance(one.centerWorld, centre) + one.radiusWorld);
    const reach = Math.max(...far) + (this.strays * spheres[0].radiusWorld) / spheres[0].radius;
    const along = this.scene.useRightHandedSystem ? -1 : 1;
    const distance = along * Vector3.TransformCoordinates(centre, camera.getViewMatrix()).z;
    const range = depths(camera.getProjectionMatrix().m, distance, reach, along);
    const inward = this.node.computeWorldMatrix(true).clone().invert();
    const eye = Vector3.TransformCoordinates(camera.globalPosition, inward);
    const turn = this.said.animation === undefined ? undefined : this.node.rotationQuaternion;
    const { x, y, z, w } = turn ?? Quaternion.Identity();
    this.meshes.forEach(({ material }, layer) => {
      material.setVector2("depth", new Vector2(...slice(layer, this.meshes.length, ...range)));
      if (this.maps) material.setVector3("eye", eye).setVector4("turn", new Vector4(x, y, z, w));
    });
  }

  /** Give back what it holds on the GPU, and the video. */
  dispose() {
    this.scene.onBeforeCameraRenderObservable.remove(this.observer);
    for (const mesh of this.meshes) mesh.dispose(false, true);
    this.picture.dispose();
    released(this.video);
  }
}
