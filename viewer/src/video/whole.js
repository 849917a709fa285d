/** The coded pictures of a video that is in memory as a whole. */

export class WholePackets {
  /** @param {import("./packets.js").Packet[]} packets in decoding order */
  constructor(packets) {
    this.frames = packets.length;
    this.packets = packets;
    this.places = new Map(packets.map((packet, i) => [packet.frame, i]));
  }

  /** Where frame `k` comes in decoding order. */
  place(k) {
    return this.places.get(k);
  }

  /** The place of the key frame at or before a place. */
  key(place) {
    while (place > 0 && !this.packets[place].key) --place;
    return place;
  }

  /** The packet at a place; null while it is not there. */
  at(place) {
    return this.packets[place];
  }

  want() {}

  close() {}
}
