// Which clip and which segments show a frame of a file. A frame may be a fraction: it blends into the next frame of its clip.

export const clipAt = (file, frame) => file.clips.findLast(({ firstFrame }) => firstFrame <= frame);
export const segmentAt = (file, frame) => file.segmentOf(Math.floor(frame));

/** Returns the numbers of the segments that show `frame`: the one that holds it, then that of the frame that it blends into. */
export function around(file, frame) {
  const { firstFrame, frameCount } = clipAt(file, frame), low = Math.floor(frame);
  const high = frame > low ? firstFrame + (low + 1 - firstFrame) % frameCount : low;
  return [...new Set([low, high].map((place) => file.segmentOf(place)))];
}
