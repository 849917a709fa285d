/** The asset's sound, if it has one: follows the pictures' clock, and is put right when it has drifted. */

const DRIFT = 0.12; // s

export class Sound {
  /** @param {ArrayBuffer} buffer an audio file that the browser knows @param {string} mime "" if it is not known */
  static of(buffer, mime) {
    return new Sound(URL.createObjectURL(new Blob([buffer], { type: mime.split(";")[0] })));
  }

  /** @param {string} address of an audio file */
  constructor(address) {
    this.audio = new Audio(address);
    this.audio.preload = address.startsWith("blob:") ? "auto" : "none";
    this.muted = true;
  }

  /** @param {import("./playback.js").Playback} playback */
  follow(playing, playback) {
    const { audio } = this;
    audio.muted = this.muted;
    const time = playback.position / playback.fps;
    if (!playing || this.muted || time >= audio.duration) {
      if (!audio.paused) audio.pause();
      return;
    }
    audio.playbackRate = playback.speed;
    if (Math.abs(audio.currentTime - time) > DRIFT * Math.max(1, playback.speed)) audio.currentTime = time;
    if (audio.paused) audio.play().catch(() => (this.muted = true));
  }

  seek(seconds) {
    if (seconds < (this.audio.duration || 0)) this.audio.currentTime = seconds;
  }

  close() {
    const { src } = this.audio;
    this.audio.pause();
    this.audio.removeAttribute("src");
    this.audio.load(); // lets go of what it was still reading, before that is revoked
    URL.revokeObjectURL(src);
  }
}
