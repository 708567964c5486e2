import {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  DirectionalLight,
  EdgesGeometry,
  Float32BufferAttribute,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  LineSegments,
  MathUtils,
  Mesh,
  MeshStandardMaterial,
  Object3D,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Texture,
  Vector2,
  Vector3,
  WebGLRenderer,
  type Matrix4,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { toCreasedNormals } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { isAid } from "../../lib/scene/aids";
import { shapeOf, type Solid } from "../../lib/scene/builder";
import { facetsOf } from "../../lib/scene/faces";
import { colourOf, DARK, lookOf, type Look } from "../../lib/scene/looks";
import { namedOf } from "../../lib/scene/names";
import { POSE } from "../../lib/scene/poses";
import type { Stage } from "../../lib/scene/stage";
import type { Drawn } from "../../lib/scene/strand";
import { standOf, VIEWS, type ViewName } from "../../lib/scene/view";
import { labelOf, type Marks } from "./drawing";

/** The layer of what the camera does not see. */
const UNSEEN = 1;
/** Of the camera, upright. [degrees] */
const ANGLE = 20;

/** Faces with more between their directions have an edge. [radians] */
const EDGE = Math.PI / 5;

const FAINT: ReadonlySet<Look> = new Set<Look>(["light", "ghost", "unknown"]);

type SolidMesh = Mesh<BufferGeometry, MeshStandardMaterial>;

/** A scene in three dimensions, of the same solids as the drawing. */
export class Space {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(ANGLE);
  private readonly controls: OrbitControls;
  private readonly meshes: SolidMesh[] = [];
  /** Of each shape itself and its edges. */
  private readonly geometries = new Map<string, readonly [BufferGeometry, BufferGeometry]>();
  /** Of the stage, the workpieces of which have meshes. */
  private revision = -1;
  private readonly lines = new LineBasicMaterial();
  private readonly looks = new Map<string, MeshStandardMaterial>();
  private readonly size: number;
  private readonly place = new Vector3();
  private isFollowing = false;
  /** The solid of what is selected that moves with it; below 0: none. */
  private goes = -1;
  private view: ViewName = "oblique";
  private readonly models: Object3D[] = [];
  private isEnded = false;
  private marks: Marks | null = null;
  /** Version of the stage when it was marked. */
  private knowledge = -1;
  /** Names of elements, with their solids. */
  private readonly labels = new Map<HTMLElement, readonly [string, readonly number[]]>();
  /** Versions of lines as they are drawn, by the numbers of their solids. */
  private readonly versions = new Map<number, number>();
  /** Something has changed since the last picture. */
  private isStale = true;

  /** Raises an error where the browser has no WebGL 2. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly stage: Stage,
    private readonly words: HTMLElement,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    const { low, high } = stage.extent;
    this.size = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    this.camera.up.set(0, 0, 1);
    this.camera.near = this.size / 100;
    this.camera.far = this.size * 20;
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", this.change);
    this.renew();
    this.light();
    for (const [name, solids] of namedOf(stage)) {
      const label = document.createElement("span");
      words.append(label);
      this.labels.set(label, [name, solids]);
    }
    canvas.addEventListener("webglcontextrestored", this.change);
  }

  /** From a side. */
  look(view: ViewName): void {
    this.view = view;
    const { near } = VIEWS[view];
    const half = Math.tan((ANGLE * Math.PI) / 360);
    const { middle, far } = standOf(VIEWS[view], this.stage.extents, [half * this.camera.aspect, half]);
    this.controls.target.set(...middle);
    // Who looks straight down would have no direction that is up.
    this.camera.position
      .set(near[0], near[1] - (view === "top" ? 1e-4 : 0), near[2])
      .multiplyScalar(far)
      .add(this.controls.target);
    this.controls.update();
    this.isStale = true;
  }

  /** The picture goes with what is selected. */
  follow(isFollowing: boolean): void {
    this.isFollowing = isFollowing;
  }

  fit(width: number, height: number): void {
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.look(this.view);
  }

  draw(): void {
    const { places, isThere } = this.stage;
    if (this.revision !== this.stage.revision) this.renew();
    if (this.marks !== null && this.knowledge !== this.stage.knowledge) this.mark(this.marks);
    for (let n = 0; n < this.meshes.length; n++) {
      const mesh = this.meshes[n] as SolidMesh;
      const isVisible = isThere[n] === 1;
      if (setMatrix(mesh.matrixWorld, places, n * POSE) || mesh.visible !== isVisible) this.isStale = true;
      mesh.visible = isVisible;
    }
    for (const [n, { count, version }] of this.stage.lines) {
      if (this.versions.get(n) === version) continue;
      this.versions.set(n, version);
      const { children, material } = this.meshes[n] as SolidMesh;
      const { geometry, material: its } = children[1] as Line<BufferGeometry, LineBasicMaterial>;
      its.color = material.color;
      geometry.setDrawRange(0, count);
      geometry.getAttribute("position").needsUpdate = true;
      this.isStale = true;
    }
    if (this.isFollowing) this.goAlong();
    if (!this.isStale) return;
    this.isStale = false;
    this.renderer.render(this.scene, this.camera);
    for (const [label, [name, solids]] of this.labels) this.name(label, name, solids);
  }

  /** The model of a body is seen in its place, from its origin on. A shape has the colour of the body, and other models their own. */
  dress(element: string, model: BufferGeometry | Object3D): void {
    const n = this.stage.solids.findIndex((one) => one.element === element);
    const [mesh, solid] = [this.meshes[n], this.stage.solids[n]];
    if (mesh === undefined || solid === undefined || this.isEnded) return;
    const [x, y, z] = solid.at;
    if (model instanceof BufferGeometry) {
      const edges = new EdgesGeometry(model.translate(-x, -y, -z), MathUtils.radToDeg(EDGE));
      this.geometries.set(`model ${element}`, [model, edges]);
      mesh.geometry = model;
      (mesh.children[0] as LineSegments).geometry = edges;
    } else {
      const moved = new Object3D();
      moved.position.set(-x, -y, -z);
      this.models.push(model);
      mesh.add(moved.add(model));
      mesh.children.forEach((one) => (one.visible = one === moved));
      mesh.layers.set(UNSEEN); // it is what a click finds
    }
    this.isStale = true;
  }

  mark(marks: Marks): void {
    this.marks = marks;
    this.knowledge = this.stage.knowledge;
    this.goes = this.stage.solids
      .slice(0, this.stage.fixed)
      .map((one) => one.element === marks.selected && one.isCarried)
      .lastIndexOf(true);
    this.isStale = true;
    for (let n = 0; n < this.stage.fixed; n++) {
      const solid = this.stage.solids[n] as Solid;
      const isSelected = solid.element === marks.selected && !isAid(solid);
      const look = lookOf(solid, marks, this.stage.isKnown[n] === 1);
      (this.meshes[n] as SolidMesh).material = this.materialOf(look, solid, isSelected);
    }
  }

  /** The colours of the page, as they are now. */
  paint(): void {
    const style = getComputedStyle(this.canvas);
    for (const [name, material] of this.looks) {
      const [look, own = "", selected] = name.split(" ");
      const color = own.startsWith("--") ? style.getPropertyValue(own) : own;
      material.color.set(color).multiplyScalar(look === "glass" ? DARK : 1);
      material.emissive.set(selected ? style.getPropertyValue("--trace-6") : look === "shining" ? color : "#000000");
      material.emissiveIntensity = look === "shining" ? 0.9 : 0.45;
    }
    this.lines.color.set(style.getPropertyValue("--dim"));
    this.isStale = true;
  }

  /** The element that is drawn at a place on the screen; empty where there is none. */
  at(x: number, y: number): string {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const ray = new Raycaster();
    ray.layers.enable(UNSEEN);
    ray.setFromCamera(new Vector2((2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height), this.camera);
    const seen = this.meshes.filter((mesh, n) => mesh.visible && (n < this.stage.aids || n >= this.stage.fixed));
    const [hit] = ray.intersectObjects(seen, false);
    return hit === undefined ? "" : (this.stage.solids[this.meshes.indexOf(hit.object as never)]?.element ?? "");
  }

  end(): void {
    this.isEnded = true;
    this.words.replaceChildren();
    for (const model of this.models) model.traverse(dispose);
    this.canvas.removeEventListener("webglcontextrestored", this.change);
    this.controls.dispose();
    for (const [shape, edges] of this.geometries.values()) {
      shape.dispose();
      edges.dispose();
    }
    for (const material of this.looks.values()) material.dispose();
    this.renderer.dispose();
  }

  /** After it was lost, the renderer gives everything to the graphics processor again. */
  private readonly change = (): void => {
    this.isStale = true;
  };

  private goAlong(): void {
    const n = this.goes;
    if (n < 0) return;
    const { places } = this.stage;
    const from = n * POSE + 9;
    this.place.set(places[from] as number, places[from + 1] as number, places[from + 2] as number);
    this.camera.position.add(this.place).sub(this.controls.target);
    this.controls.target.copy(this.place);
  }

  private light(): void {
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(-0.4, -0.7, 1);
    this.scene.add(new HemisphereLight(0xffffff, 0x777777, 1.2), new AmbientLight(0xffffff, 0.5), sun);
  }

  /** Above the middle of its solids. */
  private name(label: HTMLElement, name: string, solids: readonly number[]): void {
    const text = this.marks === null ? null : labelOf(name, this.marks);
    label.hidden = text === null;
    if (text === null) return;
    label.textContent = text;
    label.classList.toggle("selected", name === this.marks?.selected);
    label.classList.toggle("stands", this.marks?.signs.has(name) ?? false);
    const { lows, highs } = this.stage;
    const ends = (k: number) =>
      [Math.min(...solids.map((n) => lows[3 * n + k] as number)), Math.max(...solids.map((n) => highs[3 * n + k] as number))] as const; // prettier-ignore
    const [[left, right], [front, back], [, top]] = [ends(0), ends(1), ends(2)];
    this.place.set((left + right) / 2, (front + back) / 2, top).project(this.camera);
    const [x, y] = [50 * (1 + this.place.x), 50 * (1 - this.place.y)];
    label.style.left = `${x.toFixed(1)}%`;
    label.style.top = `${y.toFixed(1)}%`;
  }

  /** A mesh for each solid. */
  private renew(): void {
    const { stage, meshes } = this;
    const { solids } = stage;
    for (const mesh of meshes.splice(solids.length)) this.scene.remove(mesh);
    for (let n = this.revision < 0 ? 0 : stage.fixed; n < solids.length; n++) {
      const solid = solids[n] as Solid;
      const [shape, edges] = this.shapesOf(solid);
      const mesh = (meshes[n] ??= this.mesh(shape, edges));
      mesh.geometry = shape;
      const lines = mesh.children[0] as LineSegments;
      lines.geometry = edges;
      lines.visible = solid.material !== "light";
      mesh.material = this.materialOf(solid.material, solid, false);
      const line = stage.lines.get(n);
      if (line !== undefined) mesh.add(lineOf(line, mesh.matrixWorld, n >= stage.aids));
    }
    this.revision = stage.revision;
    this.isStale = true;
  }

  private shapesOf(solid: Solid): readonly [BufferGeometry, BufferGeometry] {
    const name = shapeOf(solid);
    const found = this.geometries.get(name);
    if (found !== undefined) return found;
    const shape = geometryOf(solid);
    const made = [shape, new EdgesGeometry(shape, MathUtils.radToDeg(EDGE))] as const;
    this.geometries.set(name, made);
    return made;
  }

  private mesh(shape: BufferGeometry, lines: BufferGeometry): SolidMesh {
    const mesh: SolidMesh = new Mesh(shape);
    const edges = new LineSegments(lines, this.lines);
    // Poses are set as they are, not computed from others.
    mesh.matrixAutoUpdate = mesh.matrixWorldAutoUpdate = false;
    edges.matrixAutoUpdate = edges.matrixWorldAutoUpdate = false;
    edges.matrixWorld = mesh.matrixWorld;
    mesh.frustumCulled = edges.frustumCulled = false;
    mesh.add(edges);
    this.scene.add(mesh);
    return mesh;
  }

  private materialOf(look: Look, solid: Solid, isSelected: boolean): MeshStandardMaterial {
    const name = `${look} ${colourOf(look, solid)} ${isSelected ? "!" : ""}`;
    let found = this.looks.get(name);
    if (found === undefined) {
      const isMetal = look === "rod" || look === "rail";
      found = new MeshStandardMaterial({ roughness: isMetal ? 0.35 : 0.7, metalness: isMetal ? 0.25 : 0 });
      // Edges lie on faces, and are seen.
      found.polygonOffset = true;
      found.polygonOffsetFactor = found.polygonOffsetUnits = 1;
      found.opacity = look === "workspace" ? 0.1 : FAINT.has(look) ? 0.3 : 1;
      found.transparent = found.opacity < 1;
      found.depthWrite = look !== "workspace";
      this.looks.set(name, found);
      this.paint();
    }
    return found;
  }
}

/** A line that goes with what it is drawn on, as the mesh of its solid does. */
function lineOf({ points }: Drawn, matrix: Matrix4, isAid: boolean): Line {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  const line = new Line(geometry, new LineBasicMaterial({ depthTest: !isAid }));
  line.renderOrder = Number(isAid);
  line.matrixAutoUpdate = line.matrixWorldAutoUpdate = line.frustumCulled = false;
  line.matrixWorld = matrix;
  return line;
}

/** The triangles of all faces; edges of less than that are smooth. */
function geometryOf(solid: Solid): BufferGeometry {
  const corners = facetsOf(solid).flatMap(([first, ...others]) =>
    others.slice(1).flatMap((corner, k) => [first, others[k], corner]),
  );
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(corners.flatMap((one) => [...(one ?? [])]), 3)); // prettier-ignore
  return toCreasedNormals(geometry, EDGE);
}

function dispose(part: Object3D): void {
  if (!(part instanceof Mesh)) return;
  const { geometry, material } = part as Mesh;
  geometry.dispose();
  for (const one of [material].flat()) {
    for (const value of Object.values(one)) if (value instanceof Texture) value.dispose();
    one.dispose();
  }
}

/** Gives whether it is another one. */
function setMatrix(matrix: Matrix4, poses: Float64Array, from: number): boolean {
  const { elements } = matrix;
  let has = false;
  for (let row = 0; row < 3; row++)
    for (let column = 0; column < 4; column++) {
      const number = poses[column < 3 ? from + 3 * row + column : from + 9 + row] as number;
      if (elements[4 * column + row] === number) continue;
      elements[4 * column + row] = number;
      has = true;
    }
  return has;
}
