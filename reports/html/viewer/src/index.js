// The 3-D view of a report: the boundary of the mesh, and the cells that are to be found. See README.md for its calls.

import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, LineBasicMaterial, LineSegments,
  Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Plane, Points, PointsMaterial, Raycaster, Scene,
  Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { UNDEFINED, colour, css, hue } from "./colours.js";
import { readItems } from "./shapes.js";
import { indices, inflate, places, unpack } from "./unpack.js";

const UNDEFINED_LEVEL = 255;
const NOT_DEFINED = 254;
const DOT = 7; // pixels of the dot that stands for a cell too small to be seen
const SMALL = 5; // pixels below which it does
const THEMES = { light: { back: 0xf4f6f8, edge: 0x26303a, shell: 0.26 }, dark: { back: 0x14181d, edge: 0xd8e0e8, shell: 0.22 } };

export async function create(host, base64, options = {}) {
  const packed = unpack(await inflate(base64));
  return new View(host, packed, options);
}

export async function unpackForTests(base64) {
  const packed = unpack(await inflate(base64));
  return { header: packed.header, points: places(packed, "item", packed.header.bits),
    items: readItems(packed, places(packed, "item", packed.header.bits), indices),
    shell: indices(packed.array("shell.nodes")), level: (id) => packed.array(`m.${id}`) };
}

class View {
  constructor(host, packed, options) {
    this.host = host;
    this.packed = packed;
    this.header = packed.header;
    this.filter = { zone: null, type: null, bar: null };
    this.pickers = [];
    this.shellPoints = places(packed, "shell", 16);
    this.itemPoints = places(packed, "item", this.header.bits);
    this.items = readItems(packed, this.itemPoints, indices);
    this.byId = new Map(this.items.map((item) => [`${item.entity} ${item.id}`, item]));
    this.metrics = new Map(this.header.metrics.map((metric) => [metric.id, metric]));
    this.levels = new Map();
    this.theme = options.theme === "dark" ? "dark" : "light";
    this.open();
    this.metric = this.metrics.get(options.metric) ?? this.header.metrics[0];
    this.readShell();
    this.buildShell();
    this.build();
    this.fitAll();
    this.render();
  }

  open() {
    const canvas = document.createElement("canvas");
    try {
      this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: false, powerPreference: "low-power" });
    } catch (error) {
      throw new Error("this browser shows no 3-D graphics (WebGL is off or missing)", { cause: error });
    }
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-label", "3-D view of the mesh. Arrow keys turn, plus and minus zoom, F shows all, Escape clears the selection.");
    this.host.replaceChildren(canvas);
    this.canvas = canvas;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.localClippingEnabled = true;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(35, 1, 0.001, 100);
    this.camera.up.set(0, 0, 1);
    this.lamp = new DirectionalLight(0xffffff, 1.9);
    this.scene.add(new AmbientLight(0xffffff, 1.5), this.lamp, this.camera);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => this.invalidate());
    this.plane = new Plane(new Vector3(-1, 0, 0), 0);
    this.clipped = [];
    const edge = new LineBasicMaterial({ transparent: true, opacity: 0.55 });
    this.materials = {
      shell: new MeshLambertMaterial({ vertexColors: true, transparent: true, side: DoubleSide, depthWrite: false, flatShading: true, forceSinglePass: true }),
      feature: new LineBasicMaterial({ transparent: true, opacity: 0.45 }),
      item: new MeshLambertMaterial({ vertexColors: true, side: DoubleSide, flatShading: true, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }),
      edge,
      dot: new PointsMaterial({ vertexColors: true, size: DOT, sizeAttenuation: false, depthTest: false, transparent: true, opacity: 0.9 }),
      chosen: new LineBasicMaterial({ color: 0x00c2ff, depthTest: false, transparent: true }),
      chosenFill: new MeshBasicMaterial({ color: 0x00c2ff, depthTest: false, transparent: true, opacity: 0.25, side: DoubleSide }),
      halo: new PointsMaterial({ color: 0x00c2ff, size: 18, sizeAttenuation: false, depthTest: false, transparent: true, opacity: 0.45 }),
    };
    this.parts = {};
    this.raycaster = new Raycaster();
    this.setTheme(this.theme);
    canvas.addEventListener("pointerdown", (event) => { this.down = [event.clientX, event.clientY]; });
    canvas.addEventListener("pointerup", (event) => {
      if (this.down && event.button === 0 && Math.hypot(event.clientX - this.down[0], event.clientY - this.down[1]) < 4) this.pick(event);
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); this.lost = true; });
    canvas.addEventListener("webglcontextrestored", () => { this.lost = false; this.invalidate(); });
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.host);
    this.resize();
  }

  // ------------------------------------------------------------------------------------------------------- the shell

  readShell() {
    const { array } = this.packed;
    this.shell = { sizes: array("shell.sizes"), nodes: indices(array("shell.nodes")), zone: array("shell.zone") };
  }

  shellShown(face) {
    const zone = this.filter.zone;
    return !zone || zone.entity !== "face" || this.shell.zone[face] === zone.index;
  }

  buildShell() {
    const { sizes, nodes, zone } = this.shell;
    const points = this.shellPoints;
    const n = this.header.shellZones.length;
    let triangles = 0;
    for (let f = 0; f < sizes.length; f++) if (this.shellShown(f)) triangles += sizes[f] - 2;
    const position = new Float32Array(9 * triangles);
    const colours = new Uint8Array(9 * triangles);
    const hues = this.header.shellZones.map((_, k) => hue(k, n - 1, this.theme === "dark").map((c) => Math.round(255 * c)));
    const edges = new Map();
    let at = 0;
    let t = 0;
    const feature = sizes.length <= 120000;
    for (let f = 0; f < sizes.length; at += sizes[f++]) {
      if (!this.shellShown(f)) continue;
      for (let k = 1; k < sizes[f] - 1; k++, t++) {
        for (let c = 0; c < 3; c++) {
          const p = nodes[at + (c === 0 ? 0 : k + c - 1)];
          position.set(points.subarray(3 * p, 3 * p + 3), 9 * t + 3 * c);
          colours.set(hues[zone[f]], 9 * t + 3 * c);
        }
      }
      if (feature) this.noteEdges(edges, f, at, sizes[f], nodes, points);
    }
    this.put("shell", new Mesh(geometry({ position, color: colours }), this.materials.shell), 1);
    const lines = [];
    for (const edge of edges.values()) if (edge.sharp) for (const p of [edge.a, edge.b]) lines.push(...points.subarray(3 * p, 3 * p + 3));
    this.put("feature", new LineSegments(geometry({ position: new Float32Array(lines) }), this.materials.feature), 2);
  }

  // Edges at which the surface bends by more than about 35 degrees, ends, or changes its zone.
  noteEdges(edges, face, at, size, nodes, points) {
    const normal = loopNormal(nodes, at, size, points);
    for (let k = 0; k < size; k++) {
      const a = nodes[at + k];
      const b = nodes[at + ((k + 1) % size)];
      const key = a < b ? a * 4294967296 + b : b * 4294967296 + a;
      const other = edges.get(key);
      if (!other) {
        edges.set(key, { a, b, normal, zone: this.shell.zone[face], sharp: true });
      } else {
        const dot = other.normal[0] * normal[0] + other.normal[1] * normal[1] + other.normal[2] * normal[2];
        other.sharp = Math.abs(dot) < 0.82 || other.zone !== this.shell.zone[face];
      }
    }
  }

  // ------------------------------------------------------------------------------------------------------- the items

  level(item) {
    if (item.entity !== this.metric.entity) return NOT_DEFINED;
    let levels = this.levels.get(this.metric.id);
    if (!levels) {
      levels = this.packed.array(`m.${this.metric.id}`);
      this.levels.set(this.metric.id, levels);
    }
    return levels[item.place];
  }

  within() {
    return Math.floor(NOT_DEFINED / this.metric.labels.length);
  }

  bin(level) {
    return level >= NOT_DEFINED ? null : Math.floor(level / this.within());
  }

  visible(item) {
    const level = this.level(item);
    const { zone, type, bar } = this.filter;
    if (level === NOT_DEFINED) return false;
    if (bar !== null && this.bin(level) !== bar) return false;
    if (type !== null && item.kind !== type) return false;
    if (zone && zone.entity === "cell") {
      if (item.entity !== "cell" || item.zone !== zone.index) return false;
    }
    return true;
  }

  // 0 for the good end of the scale, 1 for the bad one.
  badness(level) {
    const n = this.metric.labels.length * this.within();
    const part = Math.min(level / (n - 1), 1);
    return this.metric.best === "high" ? 1 - part : part;
  }

  colourOf(level) {
    return level === UNDEFINED_LEVEL ? UNDEFINED : colour(this.badness(level), this.metric.best);
  }

  build() {
    this.seen = this.items.filter((item) => this.visible(item));
    // without a bar chosen, the worse half of the scale is what is looked for, if there is any of it
    if (this.filter.bar === null && !this.everything && this.metric.best !== "none") {
      const bad = this.seen.filter((item) => { const l = this.level(item); return l === UNDEFINED_LEVEL || this.badness(l) > 0.5; });
      if (bad.length) this.seen = bad;
      else {
        const ordered = [...this.seen].sort((a, b) => this.badness(this.level(b)) - this.badness(this.level(a)));
        this.seen = ordered.slice(0, 500);
      }
    }
    const points = this.itemPoints;
    let triangles = 0;
    let segments = 0;
    for (const item of this.seen) for (const loop of item.loops) { triangles += loop.length - 2; segments += loop.length; }
    const position = new Float32Array(9 * triangles);
    const colours = new Float32Array(9 * triangles);
    const lines = new Float32Array(6 * segments);
    const centres = new Float32Array(3 * this.seen.length);
    const dots = new Float32Array(3 * this.seen.length);
    this.owner = new Uint32Array(triangles);
    let t = 0;
    let l = 0;
    this.seen.forEach((item, i) => {
      const rgb = new Color().setRGB(...this.colourOf(this.level(item)), "srgb").toArray();
      centres.set(item.centre, 3 * i);
      dots.set(rgb, 3 * i);
      for (const loop of item.loops) {
        for (let k = 1; k < loop.length - 1; k++, t++) {
          this.owner[t] = i;
          [0, k, k + 1].forEach((c, j) => {
            position.set(points.subarray(3 * loop[c], 3 * loop[c] + 3), 9 * t + 3 * j);
            colours.set(rgb, 9 * t + 3 * j);
          });
        }
        for (let k = 0; k < loop.length; k++, l++) {
          const a = loop[k];
          const b = loop[(k + 1) % loop.length];
          lines.set(points.subarray(3 * a, 3 * a + 3), 6 * l);
          lines.set(points.subarray(3 * b, 3 * b + 3), 6 * l + 3);
        }
      }
    });
    this.put("item", new Mesh(geometry({ position, color: colours }), this.materials.item), 3);
    this.put("edge", new LineSegments(geometry({ position: lines }), this.materials.edge), 4);
    this.put("dot", new Points(geometry({ position: centres, color: dots }), this.materials.dot), 5);
    const radii = this.seen.map((item) => item.radius).sort((a, b) => a - b);
    this.radius = radii.length ? radii[radii.length >> 1] : 0;
    this.invalidate();
  }

  put(name, object, order) {
    const old = this.parts[name];
    if (old) { this.scene.remove(old); old.geometry.dispose(); }
    object.renderOrder = order;
    object.frustumCulled = false;
    this.parts[name] = object;
    this.scene.add(object);
  }

  // ------------------------------------------------------------------------------------------------------- the calls

  setMetric(id) {
    const metric = this.metrics.get(id);
    if (!metric) return false;
    this.metric = metric;
    this.filter.bar = null;
    this.build();
    return true;
  }

  setFilter(changes) {
    const zone = this.filter.zone;
    Object.assign(this.filter, changes);
    if (this.filter.zone !== zone) this.buildShell();
    this.build();
  }

  showEverything(on) {
    this.everything = on;
    this.build();
  }

  shown() {
    return { cells: this.seen.length, of: this.items.filter((item) => this.level(item) !== NOT_DEFINED).length };
  }

  goTo({ entity, id }) {
    const item = this.byId.get(`${entity} ${id}`);
    if (!item) return false;
    this.choose(item);
    this.look(item.centre, Math.max(item.radius * 9, 0.012));
    return true;
  }

  choose(item) {
    this.chosen = item;
    for (const name of ["chosen", "chosenFill", "halo"]) {
      if (this.parts[name]) { this.scene.remove(this.parts[name]); this.parts[name].geometry.dispose(); delete this.parts[name]; }
    }
    if (item) {
      const points = this.itemPoints;
      const lines = [];
      const fill = [];
      for (const loop of item.loops) {
        loop.forEach((a, k) => { for (const p of [a, loop[(k + 1) % loop.length]]) lines.push(...points.subarray(3 * p, 3 * p + 3)); });
        for (let k = 1; k < loop.length - 1; k++) for (const c of [0, k, k + 1]) fill.push(...points.subarray(3 * loop[c], 3 * loop[c] + 3));
      }
      this.put("chosenFill", new Mesh(geometry({ position: new Float32Array(fill) }), this.materials.chosenFill), 6);
      this.put("chosen", new LineSegments(geometry({ position: new Float32Array(lines) }), this.materials.chosen), 7);
      this.put("halo", new Points(geometry({ position: new Float32Array(item.centre) }), this.materials.halo), 8);
    }
    this.invalidate();
    this.tell();
  }

  // What is known here about an item.
  describe(item) {
    const { low, size } = this.header;
    const longest = Math.max(...size) || 1;
    const centroid = item.centre.map((c, d) => low[d] + c * longest + size[d] / 2);
    const level = this.level(item);
    const bin = this.bin(level);
    return { entity: item.entity, id: item.id, type: item.kind, bin, centroid, undefined: level === UNDEFINED_LEVEL,
      zone: item.zone === 0xffff ? null : this.header.cellZones[item.zone], value: bin === null ? null : this.value(level) };
  }

  // The middle of the level: right to a part of the bin, for bins with two ends.
  value(level) {
    const bin = this.bin(level);
    const [a, b] = [this.metric.edges[bin], this.metric.edges[bin + 1]].map(Number);
    if (!Number.isFinite(a) || !Number.isFinite(b)) return null;
    return a + ((b - a) * (level - bin * this.within() + 0.5)) / this.within();
  }

  onPick(listener) {
    this.pickers.push(listener);
  }

  tell() {
    for (const listener of this.pickers) listener(this.chosen ? this.describe(this.chosen) : null);
  }

  pick(event) {
    const box = this.canvas.getBoundingClientRect();
    const place = new Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
    this.raycaster.setFromCamera(place, this.camera);
    const keep = (hit) => this.clipped.every((plane) => plane.distanceToPoint(hit.point) >= 0);
    const hit = this.raycaster.intersectObject(this.parts.item, false).find(keep);
    if (hit) return this.choose(this.seen[this.owner[hit.faceIndex]]);
    // else the nearest dot within reach
    let nearest = null;
    let reach = 10;
    const point = new Vector3();
    for (const item of this.seen) {
      point.set(...item.centre);
      if (!this.clipped.every((plane) => plane.distanceToPoint(point) >= 0)) continue;
      point.project(this.camera);
      if (point.z > 1) continue;
      const away = Math.hypot(((point.x - place.x) * box.width) / 2, ((point.y - place.y) * box.height) / 2);
      if (away < reach) { reach = away; nearest = item; }
    }
    return this.choose(nearest);
  }

  setClip(axis, part) {
    this.clipped = [];
    if (axis) {
      const d = "xyz".indexOf(axis);
      const longest = Math.max(...this.header.size) || 1;
      const normal = new Vector3();
      normal.setComponent(d, -1);
      this.plane.set(normal, ((part - 0.5) * this.header.size[d]) / longest + 1e-6);
      this.clipped = [this.plane];
    }
    for (const name of ["shell", "feature", "item", "edge", "dot"]) this.materials[name].clippingPlanes = this.clipped;
    this.invalidate();
  }

  fitAll() {
    const longest = Math.max(...this.header.size) || 1;
    const radius = Math.hypot(...this.header.size.map((s) => s / longest)) / 2;
    if (this.header.flat) this.camera.position.set(0, -1e-4, 1);
    else this.camera.position.set(1, -1.7, 0.9);
    this.controls.target.set(0, 0, 0);
    this.look([0, 0, 0], radius * 1.05 || 1);
  }

  fitWorst() {
    const known = this.seen.filter((item) => this.level(item) < NOT_DEFINED);
    if (!known.length) return null;
    const worst = known.reduce((a, b) => (this.badness(this.level(b)) > this.badness(this.level(a)) ? b : a));
    this.goTo(worst);
    return this.describe(worst);
  }

  // Look at a place from where the camera is, so near that `radius` fits.
  look(centre, radius) {
    const target = new Vector3(...centre);
    const way = this.camera.position.clone().sub(this.controls.target).normalize();
    const angle = (this.camera.fov / 2) * (Math.PI / 180);
    const narrow = Math.min(1, this.camera.aspect);
    const distance = radius / Math.sin(Math.atan(Math.tan(angle) * narrow));
    this.camera.position.copy(target).addScaledVector(way, distance);
    this.controls.target.copy(target);
    this.controls.update();
    this.invalidate();
  }

  key(event) {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const offset = this.camera.position.clone().sub(this.controls.target);
    if (turn) {
      const up = this.camera.up;
      const side = new Vector3().crossVectors(up, offset).normalize();
      offset.applyAxisAngle(up, 0.12 * turn[0]);
      if (Math.abs(offset.angleTo(up) - Math.PI / 2) < 1.4 || turn[1] * (offset.angleTo(up) - Math.PI / 2) < 0) offset.applyAxisAngle(side, 0.12 * turn[1]);
    } else if (event.key === "+" || event.key === "=") offset.multiplyScalar(1 / 1.2);
    else if (event.key === "-") offset.multiplyScalar(1.2);
    else if (event.key === "f" || event.key === "F") return this.fitAll();
    else if (event.key === "Escape") return this.choose(null);
    else return undefined;
    event.preventDefault();
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    return this.invalidate();
  }

  setTheme(name) {
    this.theme = name;
    const theme = THEMES[name];
    this.scene.background = new Color(theme.back);
    this.materials.edge.color.set(theme.edge);
    this.materials.feature.color.set(theme.edge);
    this.materials.shell.opacity = theme.shell;
    if (this.shell) this.buildShell();
    this.invalidate();
  }

  // Colours of the scale from its first bin to its last, for a legend.
  legend() {
    const n = this.metric.labels.length;
    return { labels: this.metric.labels, mirrored: this.metric.mirrored, undefined: css(UNDEFINED),
      colours: this.metric.labels.map((_, k) => css(this.colourOf(Math.round((k + 0.5) * this.within())))), bins: n };
  }

  resize() {
    const width = Math.max(this.host.clientWidth, 1);
    const height = Math.max(this.host.clientHeight, 1);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  snapshot() {
    this.render();
    return this.canvas.toDataURL("image/png");
  }

  invalidate() {
    if (this.pending || this.lost) return;
    this.pending = requestAnimationFrame(() => { this.pending = 0; this.render(); });
  }

  render() {
    if (this.lost || !this.parts.item) return;
    const distance = this.camera.position.distanceTo(this.controls.target);
    this.camera.near = Math.max(distance / 1000, 1e-7);
    this.camera.far = distance + 10;
    this.camera.updateProjectionMatrix();
    this.lamp.position.copy(this.camera.position).add(new Vector3(0.3, 0.2, 0.6));
    const pixels = (this.radius / Math.max(distance, 1e-9)) * (this.canvas.clientHeight / (2 * Math.tan((this.camera.fov * Math.PI) / 360)));
    this.parts.dot.visible = pixels < SMALL || this.metric.entity === "point";
    this.parts.edge.visible = pixels >= SMALL && this.seen.length < 60000;
    this.renderer.render(this.scene, this.camera);
  }

  dispose() {
    this.observer.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.host.replaceChildren();
  }
}

function geometry(attributes) {
  const made = new BufferGeometry();
  for (const [name, array] of Object.entries(attributes)) made.setAttribute(name, new BufferAttribute(array, 3, array instanceof Uint8Array));
  return made;
}

function loopNormal(nodes, at, size, points) {
  const n = [0, 0, 0];
  for (let k = 0; k < size; k++) {
    const p = 3 * nodes[at + k];
    const q = 3 * nodes[at + ((k + 1) % size)];
    n[0] += (points[p + 1] - points[q + 1]) * (points[p + 2] + points[q + 2]);
    n[1] += (points[p + 2] - points[q + 2]) * (points[p] + points[q]);
    n[2] += (points[p] - points[q]) * (points[p + 1] + points[q + 1]);
  }
  const length = Math.hypot(...n) || 1;
  return n.map((c) => c / length);
}
