// The texels of an EXR file as three.js loads it, float32 from the lowest row up: node exr.mjs IN.exr OUT.bin
import { readFileSync, writeFileSync } from "node:fs";

const { FloatType } = await import("three");
const { EXRLoader } = await import("three/addons/loaders/EXRLoader.js");
const image = new EXRLoader().setDataType(FloatType).parse(new Uint8Array(readFileSync(process.argv[2])).buffer);
writeFileSync(process.argv[3], new Uint8Array(Float32Array.from(image.data).buffer));
console.log(JSON.stringify({ width: image.width, height: image.height }));
