// Three cameras about a target, z up. Matrices are column-major.

const FIELD_OF_VIEW = 0.9;  // rad, vertical

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const sum = (a, b, factor = 1) => a.map((value, axis) => value + factor * b[axis]);

class Camera {
  constructor(target, yaw, distance) {
    this.mode = 'free';
    this.target = target;
    this.yaw = yaw;  // direction of view in the plane, rad
    this.pitch = 0.5;  // downwards, rad
    this.distance = distance;
    this.reach = 2000;  // m, that is seen behind the target
  }

  axes() {
    const pitch = this.mode === 'top' ? Math.PI / 2 : this.pitch;
    const [sy, cy, sp, cp] =
      [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(pitch), Math.cos(pitch)];
    return {forward: [cp * cy, cp * sy, -sp], right: [sy, -cy, 0], up: [sp * cy, sp * sy, cp]};
  }

  matrix(aspect) {
    const {forward, right, up} = this.axes();
    const eye = sum(this.target, forward, -this.distance);
    const view = new DOMMatrix([
      right[0], up[0], -forward[0], 0, right[1], up[1], -forward[1], 0,
      right[2], up[2], -forward[2], 0, -dot(right, eye), -dot(up, eye), dot(forward, eye), 1]);
    const near = Math.max(0.2, this.distance / 200);
    const far = this.distance + this.reach;
    const f = 1 / Math.tan(FIELD_OF_VIEW / 2);
    const isFlat = this.mode === 'top';
    const projection = new DOMMatrix(isFlat
      ? [f / (aspect * this.distance), 0, 0, 0, 0, f / this.distance, 0, 0,
        0, 0, 2 / (near - far), 0, 0, 0, (near + far) / (near - far), 1]
      : [f / aspect, 0, 0, 0, 0, f, 0, 0,
        0, 0, (near + far) / (near - far), -1, 0, 0, 2 * near * far / (near - far), 0]);
    return {matrix: projection.multiply(view).toFloat32Array(), near, far, isFlat};
  }

  turn(dx, dy) {
    this.yaw -= 0.005 * dx;
    this.pitch = Math.min(1.55, Math.max(-0.3, this.pitch + 0.005 * dy));
  }

  move(dx, dy, height) {
    const {right} = this.axes();
    const metres = 2 * this.distance * Math.tan(FIELD_OF_VIEW / 2) / height;
    this.target = sum(this.target, right, -dx * metres);
    this.target = sum(this.target, [Math.cos(this.yaw), Math.sin(this.yaw), 0], dy * metres);
  }

  zoom(factor) {
    this.distance = Math.min(2.5 * this.reach, Math.max(1, this.distance * factor));
  }

  // Behind the sensor, in its direction of travel.
  follow(scans, index) {
    const from = scans[Math.max(0, index - 3)].position;
    const to = scans[Math.min(scans.length - 1, index + 3)].position;
    this.target = scans[index].position;
    if (Math.hypot(to[0] - from[0], to[1] - from[1]) > 0.2) {
      this.yaw = Math.atan2(to[1] - from[1], to[0] - from[0]);
    }
  }
}
