/**
 * Reads EXT_layered_volumetric_video with three.js' GLTFLoader; written from the extension's text.
 *
 *     const loader = new GLTFLoader();
 *     loader.setDRACOLoader(new DRACOLoader().setDecoderPath("draco/"));
 *     loader.register((parser) => new LayeredVolumetricVideo(parser));
 *     const { scene, userData } = await loader.loadAsync("face.glb");
 *     const [face] = userData.volumetricVideos; // face.video is the HTMLVideoElement; face.seek(frame), face.dispose()
 *
 * The video's sound, if it has one, is heard after `face.video.muted = false`, upon a click.
 *
 * Layers are blended as the page is shown, in stored values: draw to the canvas, not to a linear target. A pixel is the
 * mean that the extension asks for where `renderer.setPixelRatio` is twice the screen's.
 */
import * as THREE from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { LAYER, NAME, STAYING, check, depths, follow, openVideo, released, seek, slice } from "./video.js";

const VERTEX = `
invariant gl_Position;
uniform vec2 depth; // of z and w: into the layer's slice
out vec2 st;
out vec3 point;
${STAYING}
void main() {
  st = uv;
  point = staying(position);
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(point, 1.0));
  gl_Position.z = depth.x * gl_Position.z + depth.y * gl_Position.w;
}`;

const COLOUR = `
in vec2 st;
in vec3 point;
${LAYER}
void main() {
  gl_FragColor = sRGBTransferEOTF(shown(st, point)); // three.js' output brings the stored value back
  #include <colorspace_fragment>
}`;

/** The plugin: `loader.register((parser) => new LayeredVolumetricVideo(parser))`. */
export class LayeredVolumetricVideo {
  constructor(parser) {
    this.name = NAME;
    this.parser = parser;
    this.shown = [];
  }

  /** In the place of a node's still; the still where something is damaged, or no video can be decoded. */
  createNodeMesh(index) {
    const said = this.parser.json.nodes[index].extensions?.[NAME];
    if (!said) return null;
    return this.load(index, said).catch((error) => {
      console.warn(error.message);
      return this.parser.createNodeMesh(index);
    });
  }

  async load(index, said) {
    const { parser } = this;
    const bytes = (view) => parser.getDependency("bufferView", view);
    await check(said, bytes);
    const layers = await parser.getDependency("mesh", said.mesh);
    const geometries = (layers.isGroup ? layers.children : [layers]).map((one) => one.geometry);
    const maps = said.reflection && (await parser.getDependency("texture", said.reflection.texture));
    const track = said.animation === undefined ? {} : await trackOf(parser, parser.json.animations[said.animation]);
    const video = await openVideo(parser.json, said, bytes);
    const mesh = new LayeredVideoMesh(said, geometries, video, maps, track);
    this.shown.push(mesh);
    return mesh;
  }

  /** The track follows the video: it is no clip for a mixer. */
  afterRoot(result) {
    const tracks = this.shown.map((mesh) => mesh.said.animation);
    result.animations = result.animations.filter((_, index) => !tracks.includes(index));
    result.userData.volumetricVideos = this.shown;
    for (const mesh of this.shown) if (mesh.said.torso) mesh.stand();
  }
}

async function trackOf(parser, { channels, samplers }) {
  const outputs = channels.map(({ sampler }) => parser.getDependency("accessor", samplers[sampler].output));
  const values = await Promise.all(outputs);
  return Object.fromEntries(channels.map(({ target }, i) => [target.path, values[i].array]));
}

/** All layers as one mesh, so that they are drawn in their order, whatever else the scene holds. */
export class LayeredVideoMesh extends THREE.Mesh {
  constructor(said, geometries, video, maps, track) {
    const picture = new THREE.VideoTexture(video);
    picture.flipY = false;
    picture.colorSpace = THREE.NoColorSpace; // stored values
    super(...assembled(said, geometries, picture, maps));
    Object.assign(this, { said, video, picture, track, frame: 0 });
    this.stay = new THREE.Matrix4();
    this.strays = 0; // how far what stays may be from where the node takes it
    this.frustumCulled = said.torso === undefined;
    this.rate = said.frameRate[0] / said.frameRate[1];
    this.geometry.computeBoundingSphere();
    follow(video, this.rate, said.frames, (frame) => this.pose(frame));
  }

  /** Stop at a frame; resolves when it can be drawn. @param {number} frame */
  async seek(frame) {
    await seek(this.video, this.rate, frame);
    this.picture.needsUpdate = true;
    this.pose(frame);
  }

  /** Where the head stands in a frame. */
  pose(frame) {
    this.frame = frame;
    const { rotation, translation } = this.track;
    if (rotation) this.quaternion.fromArray(rotation, 4 * frame);
    if (translation) this.position.fromArray(translation, 3 * frame);
    if (this.said.torso) this.stand();
  }

  /** Where what stays is, in the node's own axes. */
  stand() {
    const { rotation, translation } = this.said.torso;
    const { center, radius } = this.geometry.boundingSphere;
    const one = new THREE.Vector3(1, 1, 1);
    const rest = new THREE.Matrix4().compose(new THREE.Vector3(...translation), new THREE.Quaternion(...rotation), one);
    const now = new THREE.Matrix4().compose(this.position, this.quaternion, one);
    this.stay.copy(now.invert().multiply(rest));
    const turn = this.quaternion.angleTo(new THREE.Quaternion(...rotation));
    this.strays = center.clone().applyMatrix4(this.stay).distanceTo(center) + 2 * radius * Math.sin(turn / 2);
  }

  onBeforeRender(renderer, scene, camera, geometry, material) {
    const { center, radius } = geometry.boundingSphere;
    const seen = center.clone().applyMatrix4(this.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
    const reach = (radius + this.strays) * this.matrixWorld.getMaxScaleOnAxis();
    const { uniforms, layer } = material;
    uniforms.depth.value = slice(
      layer,
      this.said.rectangles.length,
      ...depths(camera.projectionMatrix.elements, -seen.z, reach),
    );
    if (this.said.torso) uniforms.stay.value = this.stay;
    if (uniforms.eye) {
      uniforms.eye.value.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(this.matrixWorld.clone().invert());
      if (this.said.animation !== undefined) uniforms.turn.value = this.quaternion;
    }
    material.uniformsNeedUpdate = true; // two layers share no values
  }

  /** Give back what it holds on the GPU, and the video. */
  dispose() {
    this.geometry.dispose();
    for (const material of this.material) material.dispose();
    this.picture.dispose();
    released(this.video);
  }
}

/** [geometry, materials]: from the innermost layer out, each to depth alone, then its colour. */
function assembled(said, geometries, picture, maps) {
  const bare = geometries.map((one) => {
    const own = new THREE.BufferGeometry().setIndex(one.index);
    return own.setAttribute("position", one.attributes.position).setAttribute("uv", one.attributes.uv);
  });
  const geometry = mergeGeometries(bare, true);
  const parts = geometry.groups;
  geometry.clearGroups();
  const materials = [];
  for (let layer = parts.length - 1; layer >= 0; layer--) {
    for (const pass of [
      { depthWrite: true, colorWrite: false },
      { depthFunc: THREE.EqualDepth, depthWrite: false },
    ]) {
      const { start, count } = parts[layer];
      geometry.addGroup(start, count, materials.length);
      materials.push(materialOf(said, layer, pass, picture, maps));
    }
  }
  return [geometry, materials];
}

function materialOf(said, layer, pass, picture, maps) {
  const { normal = [0, 0, 0], offset = 0, band = 0 } = said.torso ?? {};
  const uniforms = { depth: [1, 0], torso: [...normal, offset], band, stay: new THREE.Matrix4() };
  const coloured = pass.colorWrite !== false;
  if (coloured) {
    const [color, alpha] = [said.colorRectangle, said.alphaRectangle];
    const origins = [color[0], color[1], alpha[0], alpha[1]];
    Object.assign(uniforms, { picture, size: [said.width, said.height], rectangle: said.rectangles[layer], origins });
    if (maps) Object.assign(uniforms, reflectionOf(said.reflection, layer, maps));
  }
  const material = new THREE.ShaderMaterial({
    ...pass,
    uniforms: Object.fromEntries(Object.entries(uniforms).map(([name, value]) => [name, { value }])),
    defines: coloured && maps ? { REFLECTION: "" } : {},
    vertexShader: VERTEX,
    fragmentShader: coloured ? COLOUR : "void main() { gl_FragColor = vec4(0.0); }",
    side: THREE.DoubleSide,
    transparent: true, // for depth, too: both passes are drawn in the order of the groups
    toneMapped: false,
    forceSinglePass: true,
  });
  return Object.assign(material, { layer });
}

function reflectionOf(said, layer, maps) {
  const texture = maps.clone();
  texture.colorSpace = THREE.NoColorSpace;
  const { width, height } = texture.image;
  return {
    maps: texture,
    mapsSize: [width, height],
    environment: said.environmentRectangle,
    gloss: said.glossRectangle,
    offset: said.offsetRectangle,
    normals: said.normalsRectangle,
    scales: [said.environmentScale, said.glossScale, said.offsetScale],
    toMaps: said.transforms[layer],
    eye: new THREE.Vector3(),
    turn: new THREE.Quaternion(),
  };
}
