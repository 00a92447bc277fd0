// The camera, and the vectors and matrices that it needs. The world's z axis points up.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const sum = (a, b, factor = 1) => a.map((x, k) => x + factor * b[k]);
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

// The rotation of a unit quaternion x y z w, as rows.
function rowsOf([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

// Right, up and forward of a camera at these angles, in radians.
function axesOf(azimuth, elevation) {
  const level = [Math.cos(azimuth), Math.sin(azimuth), 0];
  const right = [-level[1], level[0], 0];
  const forward = sum(level.map((x) => -x * Math.cos(elevation)), [0, 0, -Math.sin(elevation)]);
  return { right, up: cross(right, forward), forward };
}

const RADIANS = Math.PI / 180;
// The direction of `tesdf render`.
const AZIMUTH = -60 * RADIANS;
const ELEVATION = 25 * RADIANS;
// Half of the vertical field of view.
const HALF_VIEW = Math.tan(13 * RADIANS);
// Free share of the picture on each side.
const MARGIN = 0.08;

class Camera {
  constructor() {
    this.azimuth = AZIMUTH;
    this.elevation = ELEVATION;
    this.target = [0, 0, 0];
    this.distance = 1;
    // Shares of the width at the left and of the height at the bottom that controls cover. The target
    // is in the middle of the rest.
    this.covered = [0, 0];
  }

  get axes() {
    return axesOf(this.azimuth, this.elevation);
  }

  // Moves the camera, without turning it, so that it sees these points.
  fit(points, aspect) {
    const { right, up, forward } = this.axes;
    const usable = this.covered.map((share) => HALF_VIEW * (1 - share) * (1 - 2 * MARGIN));
    const slopes = [[right, usable[0] * aspect], [up, usable[1]]];
    // In each direction, the camera lies behind the planes through the points that bound the view.
    const middle = [0, 0];
    const back = slopes.map(([axis, slope], k) => {
      const bound = (sign) => Math.max(...points.map((p) => sign * dot(axis, p) - slope * dot(forward, p)));
      const [a, b] = [bound(1), bound(-1)];
      middle[k] = (a - b) / 2;
      return -(a + b) / (2 * slope);
    });
    const depths = points.map((p) => dot(forward, p));
    const depth = (Math.min(...depths) + Math.max(...depths)) / 2;
    const eye = Math.min(...back);
    this.target = sum(sum(right.map((x) => x * middle[0]), up, middle[1]), forward, depth);
    this.distance = Math.max(depth - eye, 1e-12);
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, -89.9 * RADIANS), 89.9 * RADIANS);
  }

  // Moves by shares of the height of the picture.
  move(right, up) {
    const { right: x, up: y } = this.axes;
    const height = 2 * HALF_VIEW * this.distance;
    this.target = sum(sum(this.target, x, -right * height), y, -up * height);
  }

  zoom(factor, size) {
    this.distance = Math.min(Math.max(this.distance * factor, 1e-6 * size), 100 * size);
  }

  // From positions relative to the target to the picture, column by column. `reach` is the distance
  // from the target within which things are seen.
  view(aspect, reach) {
    const { right, up, forward } = this.axes;
    const near = Math.max(this.distance - reach, 0.02 * this.distance);
    const far = this.distance + reach;
    const [a, b] = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
    const d = this.distance;
    const matrix = [];
    for (let k = 0; k < 3; k++) {
      const [x, y] = this.covered.map((share) => share * forward[k]);
      matrix.push(right[k] / (HALF_VIEW * aspect) + x, up[k] / HALF_VIEW + y, a * forward[k], forward[k]);
    }
    return matrix.concat([this.covered[0] * d, this.covered[1] * d, a * d + b, d]);
  }

  // The point relative to the target at a place of the picture, from -1 to 1, and this depth, 0 to 1.
  point(x, y, depth, aspect, reach) {
    const { right, up, forward } = this.axes;
    const near = Math.max(this.distance - reach, 0.02 * this.distance);
    const far = this.distance + reach;
    const away = (2 * far * near) / (far + near - (2 * depth - 1) * (far - near));
    const [u, v] = [x - this.covered[0], y - this.covered[1]];
    const across = sum(right.map((r) => r * u * HALF_VIEW * aspect * away), up, v * HALF_VIEW * away);
    return sum(across, forward, away - this.distance);
  }
}
