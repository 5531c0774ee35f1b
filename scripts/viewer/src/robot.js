// A robot made of boxes, with its payload, the pushes on it, and the ground's forces.
import {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, MeshLambertMaterial, SphereGeometry, Vector3,
} from "three";

const FACES = [[0, 1], [0, -1], [1, 1], [1, -1], [2, 1], [2, -1]];
const UP = new Vector3(0, 1, 0), PAYLOAD = "#f0e442", CABLE = "#3b4148";  // no controller has the payload's

/** Boxes [sx, sy, sz, cx, cy, cz, "#color"] as one geometry; `tint` replaces the color `from`. */
function boxes(list, from, tint) {
  const position = [], normal = [], color = [], index = [];
  for (const [sx, sy, sz, cx, cy, cz, own] of list) {
    const c = new Color(own === from ? tint : own), size = [sx, sy, sz], center = [cx, cy, cz];
    for (const [axis, sign] of FACES) {
      const first = position.length / 3, u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
        const p = [...center], n = [0, 0, 0];
        p[axis] += sign * size[axis] / 2; p[u] += a * size[u] / 2; p[v] += sign * b * size[v] / 2;
        n[axis] = sign;
        position.push(...p); normal.push(...n); color.push(c.r, c.g, c.b);
      }
      index.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
  const geometry = new BufferGeometry();
  for (const [name, values] of Object.entries({ position, normal, color })) geometry.setAttribute(name, new BufferAttribute(new Float32Array(values), 3));
  geometry.setIndex(index);
  return geometry;
}

/** A robot of a scene; `pose(base, q, payload)` does the forward kinematics by three's own scene graph. A payload on a cable hangs on a `hook` of the base. */
export class Robot extends Group {
  constructor(scene, tint, hook = null) {
    super();
    this.scene = scene;
    this.hook = hook;
    this.bodies = [];
    this.material = new MeshLambertMaterial({ vertexColors: true });
    for (const body of scene.bodies) {
      const node = new Group();
      node.position.set(...body.origin);
      Object.assign(node, { origin: node.position.clone(), axis: body.axis && new Vector3(...body.axis), joint: body.joint, slides: body.slides });
      if (body.boxes.length) {
        node.mesh = new Mesh(boxes(body.boxes, scene.tint, tint), this.material);
        node.add(node.mesh);
      }
      (body.parent === null ? this : this.bodies[body.parent]).add(node);
      this.bodies.push(node);
    }
    this.ball = new Mesh(new SphereGeometry(scene.payload, 28, 18), new MeshLambertMaterial({ color: PAYLOAD }));
    this.ball.castShadow = true;
    this.cable = new Mesh(new CylinderGeometry(0.006, 0.006, 1, 8).translate(0, 0.5, 0), new MeshLambertMaterial({ color: CABLE }));
    this.add(this.ball, this.cable);
    this.ghost(false);
  }
  /** See-through without its inside: its depth is drawn first. */
  ghost(on) {
    for (const material of [this.material, this.ball.material]) Object.assign(material, { transparent: on, opacity: on ? 0.45 : 1, needsUpdate: true });
    this.ball.castShadow = !on;
    for (const node of this.bodies) {
      if (!node.mesh) continue;
      if (on && !node.depth) {
        node.depth = new Mesh(node.mesh.geometry, new MeshBasicMaterial({ colorWrite: false, transparent: true }));
        node.depth.renderOrder = 1;  // after all that is opaque, before its own color
        node.add(node.depth);
      }
      if (node.depth) node.depth.visible = on;
      node.mesh.renderOrder = on ? 2 : 0;
      node.mesh.castShadow = node.mesh.receiveShadow = !on;
    }
  }
  /** Take the colors away, or give them back. */
  gray(on) {
    if (on === Boolean(this.grayed)) return;
    this.grayed = on;
    for (const { mesh } of this.bodies) {
      if (!mesh) continue;
      const color = mesh.geometry.attributes.color, own = (mesh.own ??= color.array.slice());
      for (let i = 0; i < own.length; i += 3) {
        const mean = 0.3 * own[i] + 0.59 * own[i + 1] + 0.11 * own[i + 2];
        for (let k = 0; k < 3; k++) color.array[i + k] = on ? own[i + k] + 0.78 * (mean - own[i + k]) : own[i + k];
      }
      color.needsUpdate = true;
    }
  }
  pose(base, q, payload) {
    const [root] = this.bodies;
    root.position.set(base[0], base[1], base[2]);
    root.quaternion.set(base[3], base[4], base[5], base[6]).normalize();  // x, y, z, w as in Python
    for (const node of this.bodies) {
      if (!node.axis || node.joint === null) continue;
      if (node.slides) node.position.copy(node.origin).addScaledVector(node.axis, q[node.joint]);
      else node.quaternion.setFromAxisAngle(node.axis, q[node.joint]);
    }
    this.ball.visible = payload !== null;
    if (payload) this.ball.position.set(...payload);
    this.updateMatrixWorld(true);
    this.cable.visible = payload !== null && this.hook !== null;
    if (this.cable.visible) this.hang();
  }
  /** Draw the cable from the load to the hook. */
  hang() {
    const along = this.point([0, ...this.hook]).sub(this.ball.position), length = along.length();
    this.cable.position.copy(this.ball.position);
    this.cable.quaternion.setFromUnitVectors(UP, along.divideScalar(length || 1));
    this.cable.scale.set(1, length, 1);
    this.cable.updateMatrixWorld(true);
  }
  /** A place [body, x, y, z] in the world. */
  point([body, x, y, z]) { return new Vector3(x, y, z).applyMatrix4(this.bodies[body].matrixWorld); }
  /** A site's place in the world; null for a payload that is not there. */
  site(name) {
    if (name in this.scene.sites) return this.point(this.scene.sites[name]);
    return this.ball.visible ? this.ball.position.clone() : null;
  }
  dispose() {
    this.traverse((node) => { node.geometry?.dispose(); node.material?.dispose(); });
  }
}

/** A force whose tip is at a point, or whose tail is; longer for a larger one. */
export class Arrow extends Group {
  constructor(color, thin = 1) {
    super();
    const material = new MeshBasicMaterial({ color, transparent: true, depthTest: false });  // in front: a part of the robot would hide it
    this.shaft = new Mesh(new CylinderGeometry(0.011 * thin, 0.011 * thin, 1, 14).translate(0, -0.5, 0), material);
    this.head = new Mesh(new ConeGeometry(0.032 * thin, 0.08 * thin, 20).translate(0, -0.04 * thin, 0), material);
    this.shaft.renderOrder = this.head.renderOrder = 3;
    this.add(this.shaft, this.head);
    this.cone = 0.06 * thin;
    this.shown = false;
  }
  hide() { this.shown = this.visible = false; }
  show(tip, force, length, strength = 1) {
    this.shown = this.visible = true;
    this.position.copy(tip);
    this.quaternion.setFromUnitVectors(UP, force.clone().normalize());
    this.shaft.position.y = -this.cone;
    this.shaft.scale.y = Math.max(1e-3, length - this.cone);
    this.shaft.material.opacity = strength;
    this.ends = [tip.clone().addScaledVector(force.clone().normalize(), -length), tip.clone()];  // its note stands beyond the first
  }
  dispose() { for (const mesh of [this.shaft, this.head]) { mesh.geometry.dispose(); mesh.material.dispose(); } }
}
