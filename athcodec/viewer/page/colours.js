// Colours of vertices: by part, by order of the branch, by distance. Values are sRGB, 0 to 255; `linear` is what
// vertex colours of three.js are.

const STOPS = [[33, 53, 121], [38, 117, 148], [57, 169, 128], [171, 206, 88], [252, 231, 98], [240, 120, 58], [180, 26, 50]];
const ORDERS = [[176, 140, 110], [232, 182, 116], [150, 202, 128], [206, 222, 120], [128, 206, 204], [150, 174, 236], [206, 160, 228]];

const linear = (value) => ((value / 255 + 0.055) / 1.055) ** 2.4;
const asLinear = ([r, g, b]) => [linear(r), linear(g), linear(b)];

const HEAT = Array.from({ length: 256 }, (_, i) => {
  const at = (i / 255) * (STOPS.length - 1), k = Math.min(Math.floor(at), STOPS.length - 2);
  return asLinear(STOPS[k].map((value, c) => value + (at - k) * (STOPS[k + 1][c] - value)));
});

export const heatGradient = `linear-gradient(to right, ${STOPS.map((stop) => `rgb(${stop.join(" ")})`).join(", ")})`;

/** 0 to 1 as a colour. */
export function heat(value) {
  return HEAT[Math.max(0, Math.min(255, Math.round(value * 255)))];
}

export function orderColour(order) {
  return asLinear(ORDERS[order % ORDERS.length]);
}

/** Pale colours; neighbouring numbers get hues far from each other. */
export function nodeColour(number) {
  const hue = (number * 0.61803398875) % 1, value = 200 + 50 * ((number * 0.381966) % 1);
  const channel = (offset) => value * (0.76 + 0.24 * Math.cos(2 * Math.PI * (hue + offset)));
  return asLinear([channel(0), channel(1 / 3), channel(2 / 3)]);
}

export const orderCss = (order) => `rgb(${ORDERS[order % ORDERS.length].join(" ")})`;

/** Colours of the bark: paler towards the tips. `slim` is 0 for the trunk, 1 for twigs. */
export function barkColour(slim) {
  const mix = (a, b) => a + (b - a) * slim;
  return asLinear([mix(92, 132), mix(72, 140), mix(54, 84)]);
}
