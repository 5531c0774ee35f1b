// A hand that pulls a robot: a spring from the place that was seized to the pointer.
import { Plane, Raycaster, Vector2 } from "three";
import { Vector3 } from "./world.js";

const EVERY = 40;  // ms, between two orders

export class Hand {
  /** `say` gets site and force (N), or the site null when it lets go; `stiffness` in N/m, `most` in N. */
  constructor(stage, sites, { stiffness, most, say }) {
    Object.assign(this, { stage, sites, stiffness, most, say, ray: new Raycaster(), held: null, said: 0 });
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.#seize(event), true);
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, () => this.release());
    addEventListener("blur", () => this.release());
  }
  #seize(event) {
    if (event.button !== 0 || !event.isPrimary) return;
    const run = this.stage.runs.find((one) => this.#aim(event, one)), meshes = run?.robot.bodies.map((node) => node.mesh).filter(Boolean);
    if (!run) return;
    if (run.robot.ball.visible && this.sites.includes("payload")) meshes.push(run.robot.ball);
    const [hit] = this.ray.intersectObjects(meshes, false);
    if (!hit) return;
    const places = this.sites.map((site) => [site, run.robot.site(site)]).filter(([site, place]) => place && (site === "payload") === (hit.object === run.robot.ball));
    if (!places.length) return;
    const [[site]] = places.sort(([, a], [, b]) => a.distanceTo(hit.point) - b.distanceTo(hit.point));
    this.held = { run, site, to: null };
    this.stage.orbit.enabled = false;
    this.stage.canvas.setPointerCapture(event.pointerId);
  }
  /** Aim at what is under the pointer in a run's panel; false if it is not there. */
  #aim(event, run) {
    if (!run.seen) return false;
    const box = this.stage.canvas.getBoundingClientRect(), { x, y, w, h, camera } = run.seen;
    const at = new Vector2(((event.clientX - box.left - x) / w) * 2 - 1, 1 - ((event.clientY - box.top - y) / h) * 2);
    this.ray.setFromCamera(at, camera);
    return Math.abs(at.x) <= 1 && Math.abs(at.y) <= 1;
  }
  #move(event) {
    if (!this.held) return;
    this.#aim(event, this.held.run);
    const { run, site } = this.held, from = run.robot.site(site);
    if (!from) return this.release();
    const plane = new Plane().setFromNormalAndCoplanarPoint(run.seen.camera.getWorldDirection(new Vector3()), from);
    this.held.to = this.ray.ray.intersectPlane(plane, new Vector3());
    this.pull();
  }
  /** Tell the force, which changes while the robot moves. */
  pull() {
    const now = performance.now();
    if (!this.held?.to || now - this.said < EVERY) return;
    this.said = now;
    this.say(this.held.site, this.force().toArray());
  }
  force() {
    const { run, site, to } = this.held, from = run.robot.site(site) ?? to;
    return to.clone().sub(from).multiplyScalar(this.stiffness).clampLength(0, this.most);
  }
  /** Draw it as an arrow of its run. */
  show() {
    if (!this.held?.to) return;
    const { run, site, to } = this.held, from = run.robot.site(site), force = this.force();
    run.force = force.length();
    if (!from || !run.force) return;
    run.arrow.show(to, force, to.distanceTo(from));
    run.arrow.ends.reverse();
  }
  release() {
    if (!this.held) return;
    this.held = null;
    this.stage.orbit.enabled = true;
    this.say(null, null);
  }
}
