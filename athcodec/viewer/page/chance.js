/** Random numbers from 0 to 1, equal in every run. */
export function chance(i, salt) {
  const x = Math.sin(12.9898 * i + 78.233 * salt) * 43758.5453;
  return x - Math.floor(x);
}
