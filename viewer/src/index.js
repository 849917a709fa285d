/** Importing this module defines <facefolds-player>. */
import { FacefoldsPlayer } from "./element.js";

if (!customElements.get("facefolds-player")) customElements.define("facefolds-player", FacefoldsPlayer);

export { FacefoldsPlayer };
