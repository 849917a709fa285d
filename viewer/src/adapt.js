/**
 * Which level of detail a machine can play: measured, not guessed. While it plays, the time of every picture is held
 * against the time that there is for one; where most are late, a coarser level is asked for, and where there is plenty of
 * time, the finer one again, each time after a longer wait if that failed before.
 */

const WATCHED = 24; // pictures that a judgement needs
const LATE = 1.6; // times the time that there is
const EASY = 0.55;
const SETTLE = 1; // s after a change or a start that do not count
const WAIT = 6; // s of ease before a finer level is tried; doubled whenever one had to be left again

export class Adaptation {
  constructor() {
    this.wait = WAIT;
    this.restart();
  }

  /** After a start, a pause or another level. */
  restart() {
    this.seconds = 0;
    this.easy = 0;
    this.shares = [];
  }

  /** What is too much is left, and not tried again soon. */
  leave() {
    this.wait *= 2;
    this.restart();
  }

  /**
   * @param {number} seconds since the last picture
   * @param {number} work seconds that decoding and drawing kept the page busy, or that the picture was late
   * @param {number} budget seconds that there are for a picture
   * @returns {-1 | 0 | 1} a coarser level, this one, a finer one
   */
  note(seconds, work, budget) {
    this.seconds += seconds;
    if (this.seconds < SETTLE) return 0;
    this.shares.push(work / budget);
    if (this.shares.length < WATCHED) return 0;
    const middle = [...this.shares].sort((a, b) => a - b)[WATCHED >> 1];
    this.shares = [];
    if (middle > LATE) {
      this.leave();
      return -1;
    }
    this.easy = middle < EASY ? this.easy || this.seconds : 0;
    if (!this.easy || this.seconds - this.easy < this.wait) return 0;
    this.restart();
    return 1;
  }
}
