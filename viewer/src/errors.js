/** What the viewer of the page is told: what is wrong, where, and what to do. Every other exception is a defect of ours. */
export class PlayerError extends Error {
  /**
   * @param {string} message what is wrong, in a few words
   * @param {{remedy?: string, file?: string, kind?: string, cause?: unknown}} [details]
   *   kind: "missing", "damaged", "unsupported", "codec", "webgl", "lost" or "offline": for programs
   */
  constructor(message, { remedy = "", file = "", kind = "damaged", cause } = {}) {
    super(message, { cause });
    this.name = "PlayerError";
    this.remedy = remedy;
    this.file = file;
    this.kind = kind;
  }
}
