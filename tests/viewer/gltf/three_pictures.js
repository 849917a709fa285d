// A scene of three.js, with the renderer's materials, colours and order left as they are.
import * as THREE from "three";
import { projectionOf, viewOf } from "../../../viewer/src/camera.js";

const TO_Y_UP = new THREE.Matrix4().set(0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1); // (x, y, z) -> (y, z, x)

/** Pictures (PNG, base64) from cameras of the asset (docs/reference/conventions.md), all of one size. */
export function pictures(scene, cameras, background) {
  const renderer = new THREE.WebGLRenderer({ antialias: false });
  renderer.setSize(cameras[0].width, cameras[0].height, false);
  renderer.setClearColor(new THREE.Color(background), 1);
  const found = cameras.map((given) => {
    const camera = new THREE.Camera();
    camera.projectionMatrix.fromArray(projectionOf(given, given.width, given.height, 0.01, 10));
    camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
    const place = new THREE.Matrix4().fromArray(viewOf(given.w2c)).invert().premultiply(TO_Y_UP);
    place.decompose(camera.position, camera.quaternion, camera.scale);
    renderer.render(scene, camera);
    return renderer.domElement.toDataURL("image/png").split(",")[1];
  });
  renderer.dispose();
  return found;
}
