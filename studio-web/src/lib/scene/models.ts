import { Matrix4, Object3D, TextureLoader, type BufferGeometry } from "three";
import { GLTFLoader, type GLTFParser } from "three/examples/jsm/loaders/GLTFLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import type { Backend } from "../protocol/backend";

/** Of glTF: metres with y up, as mm with z up. */
const UPRIGHT = new Matrix4().makeRotationX(Math.PI / 2).scale(new Object3D().scale.setScalar(1000));

/** The model of a body: in STL a shape without colours. The studio has looked at it. Rejects with the words of the studio. */
export async function modelOf(file: string, backend: Backend): Promise<BufferGeometry | Object3D> {
  const data = await (await backend.file("models", file)).arrayBuffer();
  if (file.toLowerCase().endsWith(".stl")) return new STLLoader().parse(data);
  const loader = new GLTFLoader();
  loader.register((parser: GLTFParser) => {
    // An image bitmap would be fetched, which the policy of the page does not permit; an image may come out of the file.
    parser.textureLoader = new TextureLoader(parser.options.manager);
    return { name: "steptwin" };
  });
  const { scene } = await loader.parseAsync(data, "");
  const whole = new Object3D();
  whole.applyMatrix4(UPRIGHT);
  return whole.add(scene);
}
