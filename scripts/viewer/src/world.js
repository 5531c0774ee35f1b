// Ground, light and camera; one renderer for a whole page, since browsers give few WebGL contexts.
import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, HemisphereLight, InstancedMesh, Line, LineBasicMaterial, LineDashedMaterial, Matrix4, Mesh,
  MeshBasicMaterial, Object3D, PCFShadowMap, PerspectiveCamera, PlaneGeometry, Scene, ShaderMaterial, ShadowMaterial, Vector3, WebGLRenderer,
} from "three";
import { isDark } from "./page.js";

Object3D.DEFAULT_UP.set(0, 0, 1);
const SUN = new Vector3(1, 1.5, 3).normalize();
const FIELD_OF_VIEW = 40;  // degrees, of the shorter side

/** Whether this browser can draw. */
export const able = () => {
  try { return Boolean(document.createElement("canvas").getContext("webgl2")); } catch { return false; }
};

let shared = null;
const renderer = () => {
  if (!shared) {
    shared = new WebGLRenderer({ antialias: true, powerPreference: "low-power" });
    shared.shadowMap.enabled = true;
    shared.shadowMap.type = PCFShadowMap;
    shared.autoClear = false;
    shared.setScissorTest(true);
  }
  return shared;
};

/** A line through points (flat list); `show(n)` draws the first n of them. */
export class Path extends Line {
  constructor(points, color, { dashed = false, opacity = 0.9 } = {}) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
    const look = { color, transparent: true, opacity };
    super(geometry, dashed ? new LineDashedMaterial({ ...look, dashSize: 0.03, gapSize: 0.025 }) : new LineBasicMaterial(look));
    if (dashed) this.computeLineDistances();
    this.frustumCulled = false;
  }
  show(count) { this.geometry.setDrawRange(0, count); }
  dispose() { this.geometry.dispose(); this.material.dispose(); }
}

/** Frames on the ground where soles are meant to be. */
function footholds(places, [length, width]) {
  const thick = 0.008, bars = [[0, width / 2, length, thick], [0, -width / 2, length, thick], [length / 2, 0, thick, width], [-length / 2, 0, thick, width]];
  const mesh = new InstancedMesh(new PlaneGeometry(1, 1), new MeshBasicMaterial({ color: "#7f8b9b", transparent: true, opacity: 0.75, side: DoubleSide, depthWrite: false }), 4 * places.length);
  const matrix = new Matrix4();
  places.forEach(([x, y], i) => bars.forEach(([dx, dy, sx, sy], k) => mesh.setMatrixAt(4 * i + k, matrix.makeScale(sx, sy, 1).setPosition(x + dx, y + dy, 0.003))));
  mesh.frustumCulled = false;
  return mesh;
}

const GROUND = {
  vertexShader: "varying vec3 at; void main() { vec4 w = modelMatrix * vec4(position, 1.); at = w.xyz; gl_Position = projectionMatrix * viewMatrix * w; }",
  fragmentShader: `
    varying vec3 at; uniform vec3 ground, line, sky; uniform vec2 center;
    float grid(vec2 p, float spacing, float thick) {
      vec2 w = fwidth(p) + 1e-6, d = abs(fract(p / spacing - .5) - .5) * spacing;
      vec2 on = clamp((thick * .5 - d) / w + .5, 0., 1.) * min(vec2(1.), thick / w + .25);
      return max(on.x, on.y);
    }
    void main() {
      float near = exp(-dot(at.xy - center, at.xy - center) / 60.);
      vec3 c = mix(ground, line, max(.55 * grid(at.xy, .5, .008), grid(at.xy, 5., .02)));
      gl_FragColor = vec4(mix(sky, c, near), 1.);
      #include <colorspace_fragment>
    }`,
};

/** What is around the robots of one replay. */
export class World {
  constructor(scene) {
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.05, 200);
    this.reach = scene.outlook.reach;
    this.sun = new DirectionalLight(0xffffff, 1.7);
    Object.assign(this.sun, { castShadow: true });
    Object.assign(this.sun.shadow, { radius: 3, bias: -0.0006, normalBias: 0.006 });
    this.sun.shadow.mapSize.set(1024, 1024);
    const uniforms = { ground: { value: new Color() }, line: { value: new Color() }, sky: { value: new Color() }, center: { value: { x: 0, y: 0 } } };
    const offset = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 8 };
    this.floor = new Mesh(new PlaneGeometry(160, 160), new ShaderMaterial({ ...GROUND, ...offset, uniforms }));
    this.shade = new Mesh(new PlaneGeometry(12, 12), new ShadowMaterial({ opacity: 0.28 }));  // small: huge triangles lose depth bits
    this.shade.receiveShadow = true;
    this.floor.renderOrder = -2;
    this.shade.renderOrder = -1;
    this.scene.add(new HemisphereLight(0xffffff, 0xb9b2a8, 2.1), this.sun, this.sun.target, this.floor, this.shade);
    if (scene.path) this.scene.add(new Path(scene.path, "#8791a1", { dashed: true }));
    if (scene.footholds.length) this.scene.add(footholds(scene.footholds, scene.sole));
  }
  theme() {
    const dark = isDark(), { sky, ground, line } = this.floor.material.uniforms;
    sky.value.set(dark ? "#12161b" : "#ffffff");
    ground.value.set(dark ? "#1f262e" : "#e9edf2");
    line.value.set(dark ? "#46525f" : "#a9b6c7");
    this.shade.material.opacity = dark ? 0.5 : 0.28;
  }
  /** Begin a picture of so many CSS pixels. */
  begin(width, height) {
    const gl = renderer(), ratio = Math.min(2, devicePixelRatio), now = gl.domElement;
    if (now.width !== Math.floor(width * ratio) || now.height !== Math.floor(height * ratio)) {
      gl.setPixelRatio(ratio);
      gl.setSize(width, height, false);
    }
    this.theme();
    gl.setClearColor(this.floor.material.uniforms.sky.value);
    gl.setScissor(0, 0, width, height);
    gl.clear();
    this.height = height;
  }
  /** Draw a rectangle of it with what is visible now; the light is aimed at `target`. */
  draw(x, y, width, height, target, wider = 1) {
    const gl = renderer(), { camera, sun } = this, reach = this.reach * wider;
    sun.target.position.copy(target);
    sun.position.copy(target).addScaledVector(SUN, 6);
    const light = sun.shadow.camera;
    if (light.right !== reach) { Object.assign(light, { left: -reach, bottom: -reach, right: reach, top: reach, near: 1, far: 14 }); light.updateProjectionMatrix(); }
    this.floor.material.uniforms.center.value = { x: target.x, y: target.y };
    this.floor.position.set(Math.round(target.x), Math.round(target.y), 0);
    this.shade.position.set(target.x, target.y, 0.0008);
    this.shape(width, height);
    gl.setViewport(x, this.height - y - height, width, height);
    gl.setScissor(x, this.height - y - height, width, height);
    gl.clear();
    gl.render(this.scene, camera);
  }
  /** Tangents of half the field of view across and up, which the shorter side of a rectangle has. */
  slopes(width, height) {
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360), up = half / Math.min(1, width / height);
    return [(up * width) / height, up];
  }
  /** Give the camera the shape of a rectangle. */
  shape(width, height) {
    const { camera } = this, [, up] = this.slopes(width, height);
    camera.aspect = width / height;
    camera.fov = (360 / Math.PI) * Math.atan(up);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }
  /** Copy the picture to a canvas. */
  copy(canvas) {
    const from = renderer().domElement;
    if (canvas.width !== from.width || canvas.height !== from.height) Object.assign(canvas, { width: from.width, height: from.height });
    canvas.getContext("2d").drawImage(from, 0, 0);
  }
}
export { Vector3 };
