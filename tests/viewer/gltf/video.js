// What pages with a player of EXT_layered_volumetric_video ask of its video.

/** What a video shows or tells once it plays: asked at each picture until it is enough, for 20 seconds at most. */
async function whilePlaying(face, enough) {
  await face.video.play();
  const end = performance.now() + 20000;
  while (!enough() && performance.now() < end) await new Promise((done) => requestAnimationFrame(done));
  face.dispose();
}

/** The frames that a video that plays shows until it has shown some. */
export async function framesOf(face) {
  const seen = new Set();
  face.video.playbackRate = 0.0625; // a busy machine draws few pictures a second: each frame lasts for some
  await whilePlaying(face, () => seen.add(face.frame).size >= 3);
  return [...seen];
}

/** Bytes of sound that were decoded once it plays. */
export async function soundOf(face) {
  let found = 0;
  face.video.muted = false;
  await whilePlaying(face, () => (found = face.video.webkitAudioDecodedByteCount));
  return found;
}

/** What is warned of from now on. */
export function warnings() {
  const said = [];
  console.warn = (words) => said.push(words);
  return said;
}
