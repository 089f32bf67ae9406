/**
 * athcodec-three/viewer: a web component that plays .ath files.
 *
 *     <script type="module">import "athcodec-three/viewer";</script>
 *     <ath-viewer src="oak.ath" camera-controls alt="An oak in the wind"></ath-viewer>
 *
 * It is as large as its style says, transparent behind the plant, and draws only what is in view; all elements share one WebGL context.
 * What stands in it, such as a picture, is shown until the plant is; where that cannot be drawn, a sentence says so. For visitors who
 * want less motion it stands still until its button, or play(), starts it. Attributes, of which all but the last four can change:
 *
 * * src: the file's address;
 * * clip: the name of the clip that plays (default: the first);
 * * wind: strength and heading, "6 90", in place of a clip, where the clips say which wind they show;
 * * level: a level of detail, or "auto" (default): as much as can be seen;
 * * speed: 1 is real time;
 * * paused;
 * * camera-controls: the plant can be turned and zoomed by mouse and touch; "turn": only turned, so that the page scrolls;
 * * alt: what is seen, in words;
 * * loading="lazy": the file is fetched once the element comes into view, and given back a while after it has left;
 * * scenery: sky, meadow and shadows around the plant;
 * * forest: in scenery, so many of the plant; floor: files for its floor, "fern.ath=4 grass.ath", so many to a tree.
 *
 * Events: "load" (detail: {ath}) at the first picture, "progress" (detail: {loaded, total}), "error" (detail: an ATHFailure, or what went
 * wrong later, with message and codeName).
 */

import { Camera } from "three";
import { ATH, ATHForest, ATHLoader } from "athcodec-three";

export class ATHViewerElement extends HTMLElement {
  /** The loader of all elements: setDecoderPath() and the like hold for files that load later. */
  static readonly loader: ATHLoader;
  src: string | null;
  paused: boolean;
  /** Seconds. */
  currentTime: number;
  play(): void;
  pause(): void;
  /** Null before the first picture. */
  readonly ath: ATH | null;
  /** With the attribute: the trees, and each plant of the floor that is here. */
  readonly forests: ATHForest[];
  /** Another one each time that a lazy element comes into view. */
  readonly camera: Camera;
}

declare global {
  interface HTMLElementTagNameMap {
    "ath-viewer": ATHViewerElement;
  }
}

/** The attributes of <ath-viewer> as JSX takes them. */
export interface ATHViewerAttributes {
  src?: string;
  clip?: string;
  wind?: string;
  level?: number | "auto" | `${number}`;
  speed?: number | string;
  paused?: boolean;
  "camera-controls"?: boolean | "" | "turn";
  alt?: string;
  loading?: "lazy";
  scenery?: boolean;
  forest?: number | string;
  floor?: string;
}

// Pages without React have no such module, which is no error of theirs.
// @ts-ignore
declare module "react" {
  namespace JSX {
    interface IntrinsicElements {
      // @ts-ignore
      "ath-viewer": ATHViewerAttributes & import("react").DetailedHTMLProps<import("react").HTMLAttributes<ATHViewerElement>, ATHViewerElement>;
    }
  }
}
