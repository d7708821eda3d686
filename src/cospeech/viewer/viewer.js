/* The 3D viewer of cospeech: bodies that move to a sound. It needs THREE (vendor/three.js) and nothing else.
   Lengths are in metres and y is up. All positions come from the function `pose` below, forward kinematics. */
var CospeechViewer = (() => {
  "use strict";

  const TURN = 32767, LENGTH_M = 1e-4, LOST = -(2 ** 31), CURVE_LEVELS = 1000;
  const COLOURS = ["#2278b5", "#d55e00", "#00795a", "#9a5bb8", "#b8860b", "#c2407a", "#4a6f7c", "#7d6a2a"];
  const SPEEDS = [0.1, 0.25, 0.5, 1, 1.5, 2];
  const LOOKS = { body: "Body", skeleton: "Skeleton", axes: "Joint axes" };
  const TRAIL_S = 1.2, TRAIL_POINTS = 36, NARROW_PX = 640, MANY_JOINTS = 400;

  /* ---- unpacking ---- */

  const bytes = text => Uint8Array.from(atob(text), letter => letter.charCodeAt(0));

  async function inflated(text) {
    const stream = new Blob([bytes(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }

  /* Numbers (T, n) that were stored as differences along time, column by column. */
  async function columns(text, Kind, frames) {
    const steps = new Kind(await inflated(text)), width = steps.length / frames, values = new Kind(steps.length);
    for (let column = 0; column < width; column++) {
      let sum = 0;
      for (let frame = 0; frame < frames; frame++) {
        sum = (sum + steps[column * frames + frame]) << 8 * (4 - Kind.BYTES_PER_ELEMENT) >> 8 * (4 - Kind.BYTES_PER_ELEMENT);
        values[frame * width + column] = sum;
      }
    }
    return values;
  }

  async function unpacked(version) {
    const metres = async text => Float32Array.from(await columns(text, Int32Array, version.frames), value => value === LOST ? NaN : value * LENGTH_M);
    const turns = await columns(version.turns, Int16Array, version.frames);
    const lengths = version.places ? { places: await metres(version.places) } : { root: await metres(version.root) };
    return { ...version, ...lengths, turns: Float32Array.from(turns, value => value / TURN) };
  }

  /* ---- forward kinematics ---- */

  /* Write the positions (J x 3) and orientations (J x 4: x, y, z, w) of all joints at a time into `out`. A version has
     either `places`, positions and orientations in the world, or poses of rigid bones. */
  function pose(version, time, out) {
    const n = version.parents.length, last = version.frames - 1;
    const at = Math.min(Math.max(time * version.fps - 0.5, 0), last);
    const first = Math.min(Math.floor(at), Math.max(last - 1, 0)), second = Math.min(first + 1, last), share = at - first;
    const { root, places, turns, offsets, parents } = version, { place, turn } = out;
    for (let j = 0; j < n; j++) {
      const a = (first * n + j) * 4, b = (second * n + j) * 4;
      const dot = turns[a] * turns[b] + turns[a + 1] * turns[b + 1] + turns[a + 2] * turns[b + 2] + turns[a + 3] * turns[b + 3];
      const to = dot < 0 ? -share : share, from = 1 - share;
      let w = from * turns[a] + to * turns[b], x = from * turns[a + 1] + to * turns[b + 1];
      let y = from * turns[a + 2] + to * turns[b + 2], z = from * turns[a + 3] + to * turns[b + 3];
      const norm = Math.hypot(w, x, y, z) || 1;
      w /= norm; x /= norm; y /= norm; z /= norm;
      const p = parents[j], o = 3 * j, q = 4 * j;
      if (places) {
        for (let k = 0; k < 3; k++) place[o + k] = (1 - share) * places[3 * (first * n + j) + k] + share * places[3 * (second * n + j) + k];
        turn[q] = x; turn[q + 1] = y; turn[q + 2] = z; turn[q + 3] = w;
        continue;
      }
      if (p < 0) {
        for (let k = 0; k < 3; k++) place[o + k] = offsets[o + k] + (1 - share) * root[3 * first + k] + share * root[3 * second + k];
        turn[q] = x; turn[q + 1] = y; turn[q + 2] = z; turn[q + 3] = w;
        continue;
      }
      const px = turn[4 * p], py = turn[4 * p + 1], pz = turn[4 * p + 2], pw = turn[4 * p + 3];
      const ox = offsets[o], oy = offsets[o + 1], oz = offsets[o + 2];
      const cx = 2 * (py * oz - pz * oy), cy = 2 * (pz * ox - px * oz), cz = 2 * (px * oy - py * ox);
      place[o] = place[3 * p] + ox + pw * cx + py * cz - pz * cy;
      place[o + 1] = place[3 * p + 1] + oy + pw * cy + pz * cx - px * cz;
      place[o + 2] = place[3 * p + 2] + oz + pw * cz + px * cy - py * cx;
      turn[q] = pw * x + px * w + py * z - pz * y;
      turn[q + 1] = pw * y - px * z + py * w + pz * x;
      turn[q + 2] = pw * z + px * y - py * x + pz * w;
      turn[q + 3] = pw * w - px * x - py * y - pz * z;
    }
    return out;
  }

  const room = n => ({ place: new Float64Array(3 * n), turn: new Float64Array(4 * n) });

  /* The joints whose trails are drawn: those called hands, otherwise the ends of the body that move farthest. */
  function hands(version) {
    const named = version.joints.map((name, j) => [name.toLowerCase().replace(/[^a-z]/g, ""), j])
      .filter(([name]) => /^(left|right|l|r)?(hand|wrist)(left|right|l|r)?$/.test(name)).map(([, j]) => j);
    if (named.length) return named.slice(0, 2);
    const ends = version.joints.map((_, j) => j).filter(j => !version.parents.includes(j));
    const out = room(version.parents.length), low = new Map(), high = new Map();
    for (let k = 0; k <= 20; k++) {
      pose(version, k / 20 * version.frames / version.fps, out);
      for (const j of ends) for (let a = 0; a < 3; a++) {
        const key = 3 * j + a, value = out.place[key];
        low.set(key, Math.min(low.get(key) ?? value, value)); high.set(key, Math.max(high.get(key) ?? value, value));
      }
    }
    const range = j => [0, 1, 2].reduce((sum, a) => sum + high.get(3 * j + a) - low.get(3 * j + a), 0);
    return ends.sort((a, b) => range(b) - range(a)).slice(0, 2);
  }

  /* ---- one body in the scene ---- */

  class Figure {
    constructor(version, surface, colour) {
      this.version = version;
      this.colour = new THREE.Color(colour);
      this.n = version.parents.length;
      this.now = room(this.n);
      this.past = room(this.n);
      this.hands = hands(version);
      this.group = new THREE.Group();
      this.extent = this.measure();
      const reach = Math.max(this.extent.high[1] - this.extent.low[1], this.extent.high[0] - this.extent.low[0], 1e-3);
      this.addBones(reach);
      this.addAxes(reach);
      this.addTrails();
      if (surface) this.addSurface(surface);
      this.shadow = new THREE.Mesh(
        new THREE.CircleGeometry(0.16 * reach, 32).rotateX(-Math.PI / 2),
        new THREE.MeshBasicMaterial({ color: 0x000000, transparent: true, opacity: 0.16, depthWrite: false }),
      );
      this.group.add(this.shadow);
    }

    /* The box that the joints stay in, from a sample of the frames. */
    measure() {
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (let k = 0; k <= 60; k++) {
        pose(this.version, k / 60 * this.version.frames / this.version.fps, this.now);
        for (let i = 0; i < 3 * this.n; i++) {
          const value = this.now.place[i];
          if (value < low[i % 3]) low[i % 3] = value;
          if (value > high[i % 3]) high[i % 3] = value;
        }
      }
      for (let a = 0; a < 3; a++) if (low[a] > high[a]) low[a] = high[a] = 0;
      return { low, high };
    }

    /* A surface whose vertices are carried by joints: `bind` leads from their frame to that of the joint. */
    addSurface(surface) {
      const geometry = new THREE.BufferGeometry();
      const attribute = (text, Kind, width) => new THREE.BufferAttribute(new Kind(bytes(text).buffer), width, width > 1);
      geometry.setAttribute("position", attribute(surface.position, Int16Array, 3));
      geometry.setAttribute("normal", attribute(surface.normal, Int16Array, 3));
      geometry.setAttribute("color", attribute(surface.colour, Uint16Array, 3));
      geometry.setAttribute("skinWeight", attribute(surface.weight, Uint16Array, 4));
      geometry.setAttribute("skinIndex", new THREE.BufferAttribute(new Uint16Array(bytes(surface.slot).buffer), 4));
      geometry.setIndex(attribute(surface.triangle, Uint32Array, 1));
      this.slots = surface.joint;
      this.joints = this.slots.map(() => new THREE.Bone());
      this.joints.forEach(joint => this.group.add(joint));
      const binds = surface.bind.map(rows => new THREE.Matrix4().set(...rows, 0, 0, 0, 1));
      const sides = this.version.surface ? THREE.DoubleSide : THREE.FrontSide;
      this.surface = new THREE.SkinnedMesh(geometry, new THREE.MeshLambertMaterial({ vertexColors: true, side: sides }));
      this.surface.bind(new THREE.Skeleton(this.joints, binds), new THREE.Matrix4());
      this.surface.frustumCulled = false;
      this.group.add(this.surface);
      this.widen();
    }

    /* Let the box of the joints contain the surface, which reaches beyond them as far as it does in the first frame. */
    widen() {
      const { place, turn } = pose(this.version, 0, this.now), low = [Infinity, Infinity, Infinity], high = low.map(a => -a);
      for (let i = 0; i < 3 * this.n; i++) {
        low[i % 3] = Math.min(low[i % 3], place[i]); high[i % 3] = Math.max(high[i % 3], place[i]);
      }
      this.placeSurface(place, turn);
      this.group.updateMatrixWorld(true);
      this.surface.skeleton.update();
      this.surface.computeBoundingBox();
      const box = this.surface.boundingBox;
      for (let a = 0; a < 3; a++) {
        this.extent.low[a] += Math.min(box.min.getComponent(a) - low[a], 0);
        this.extent.high[a] += Math.max(box.max.getComponent(a) - high[a], 0);
      }
    }

    placeSurface(place, turn) {
      this.joints.forEach((joint, slot) => {
        const j = this.slots[slot];
        joint.position.set(place[3 * j], place[3 * j + 1], place[3 * j + 2]);
        joint.quaternion.set(turn[4 * j], turn[4 * j + 1], turn[4 * j + 2], turn[4 * j + 3]);
      });
    }

    addBones(reach) {
      this.links = this.version.parents.map((p, j) => [p, j]).filter(([p]) => p >= 0);
      const shape = new THREE.CylinderGeometry(0.35, 1, 1, 8, 1).translate(0, 0.5, 0);
      this.bones = new THREE.InstancedMesh(shape, new THREE.MeshLambertMaterial({ color: this.colour }), Math.max(this.links.length, 1));
      this.knots = new THREE.InstancedMesh(new THREE.SphereGeometry(1, this.n > MANY_JOINTS ? 4 : 10, this.n > MANY_JOINTS ? 2 : 8), new THREE.MeshLambertMaterial({ color: this.colour }), this.n);
      this.thick = Math.min(0.022, 0.25 / Math.sqrt(this.n)) * reach;
      this.bones.frustumCulled = this.knots.frustumCulled = false;
      this.group.add(this.bones, this.knots);
    }

    addAxes(reach) {
      const points = new THREE.BufferGeometry(), shades = new Float32Array(18 * this.n);
      for (let j = 0; j < this.n; j++) for (let a = 0; a < 3; a++) for (const end of [0, 1]) shades[18 * j + 6 * a + 3 * end + a] = 0.85;
      points.setAttribute("position", new THREE.BufferAttribute(new Float32Array(18 * this.n), 3));
      points.setAttribute("color", new THREE.BufferAttribute(shades, 3));
      this.axes = new THREE.LineSegments(points, new THREE.LineBasicMaterial({ vertexColors: true }));
      this.axes.frustumCulled = false;
      this.axisLength = 0.05 * reach;
      this.group.add(this.axes);
    }

    addTrails() {
      this.trails = this.hands.map(() => {
        const line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: this.colour }));
        line.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * TRAIL_POINTS), 3));
        line.frustumCulled = false;
        this.group.add(line);
        return line;
      });
    }

    /* Show the pose at a time. `look`: how the body is drawn; `trails`: whether the paths of the hands are. */
    show(time, look, trails, ghost) {
      const { place, turn } = pose(this.version, time, this.now);
      const drawn = this.surface ? look : look === "body" ? "skeleton" : look;
      if (this.surface) {
        this.surface.visible = drawn === "body";
        this.surface.material.transparent = ghost;
        this.surface.material.opacity = ghost ? 0.55 : 1;
        this.placeSurface(place, turn);
      }
      this.bones.visible = this.knots.visible = drawn !== "body";
      if (this.bones.visible) this.placeBones(place, drawn === "axes" ? 0.45 : 1);
      this.axes.visible = drawn === "axes";
      if (this.axes.visible) this.placeAxes(place, turn);
      this.trails.forEach(line => { line.visible = trails; });
      if (trails) this.placeTrails(time);
      this.shadow.position.set(place[0], this.extent.low[1] + 0.002, place[2]);
    }

    placeBones(place, scale) {
      const up = new THREE.Vector3(0, 1, 0), from = new THREE.Vector3(), to = new THREE.Vector3(), along = new THREE.Vector3();
      const turned = new THREE.Quaternion(), matrix = new THREE.Matrix4(), size = new THREE.Vector3();
      this.links.forEach(([p, j], index) => {
        from.fromArray(place, 3 * p); to.fromArray(place, 3 * j); along.subVectors(to, from);
        const length = along.length() || 1e-9, thick = length > 0 ? scale * Math.min(this.thick, 0.25 * length) : 0;
        if (!thick) { this.bones.setMatrixAt(index, matrix.makeScale(0, 0, 0)); return; }
        turned.setFromUnitVectors(up, along.divideScalar(length));
        this.bones.setMatrixAt(index, matrix.compose(from, turned, size.set(thick, length, thick)));
      });
      turned.identity();
      for (let j = 0; j < this.n; j++) {
        const radius = place[3 * j] < Infinity ? 0.8 * scale * this.thick : 0;
        if (!radius) { this.knots.setMatrixAt(j, matrix.makeScale(0, 0, 0)); continue; }
        this.knots.setMatrixAt(j, matrix.compose(from.fromArray(place, 3 * j), turned, size.set(radius, radius, radius)));
      }
      this.bones.count = this.links.length;
      this.bones.instanceMatrix.needsUpdate = this.knots.instanceMatrix.needsUpdate = true;
    }

    placeAxes(place, turn) {
      const points = this.axes.geometry.attributes.position, axis = new THREE.Vector3(), turned = new THREE.Quaternion();
      for (let j = 0; j < this.n; j++) {
        turned.fromArray(turn, 4 * j);
        for (let a = 0; a < 3; a++) {
          axis.set(a === 0, a === 1, a === 2).multiplyScalar(this.axisLength).applyQuaternion(turned);
          for (let k = 0; k < 3; k++) {
            points.array[18 * j + 6 * a + k] = place[3 * j + k];
            points.array[18 * j + 6 * a + 3 + k] = place[3 * j + k] + axis.getComponent(k);
          }
        }
      }
      points.needsUpdate = true;
    }

    placeTrails(time) {
      for (let k = 0; k < TRAIL_POINTS; k++) {
        pose(this.version, time - TRAIL_S * (1 - k / (TRAIL_POINTS - 1)), this.past);
        this.hands.forEach((j, index) => {
          for (let a = 0; a < 3; a++) this.trails[index].geometry.attributes.position.array[3 * k + a] = this.past.place[3 * j + a];
        });
      }
      this.trails.forEach(line => { line.geometry.attributes.position.needsUpdate = true; });
    }

    dispose() {
      this.group.traverse(part => { part.geometry?.dispose(); part.material?.dispose(); });
    }
  }

  /* ---- the clock: that of the sound, as long as there is sound ---- */

  class Clock {
    constructor() {
      this.audio = new Audio();
      this.audio.preload = "auto";
      this.playing = false; this.speed = 1; this.at = 0; this.duration = 0; this.since = 0;
    }

    load(take) {
      this.pause();
      if (this.url) URL.revokeObjectURL(this.url);
      this.url = take.sound ? URL.createObjectURL(new Blob([bytes(take.sound)], { type: "audio/mp4" })) : null;
      if (this.url) this.audio.src = this.url; else this.audio.removeAttribute("src");
      this.duration = take.duration; this.at = 0;
    }

    get heard() { return this.playing && this.url && !this.audio.ended && !this.audio.error; }

    get time() {
      if (!this.playing) return this.at;
      if (this.heard) { this.at = this.audio.currentTime; this.since = performance.now(); return this.at; }
      const now = performance.now();
      this.at += (now - this.since) / 1000 * this.speed; this.since = now;
      return this.at;
    }

    seek(time) {
      this.at = Math.min(Math.max(time, 0), this.duration);
      this.since = performance.now();
      if (this.url) this.audio.currentTime = this.at;
    }

    async play() {
      if (this.at >= this.duration - 1e-3) this.seek(0);
      this.since = performance.now();
      this.audio.playbackRate = this.speed;
      this.playing = true;
      if (this.url && this.at < (this.audio.duration || Infinity)) {
        try { await this.audio.play(); } catch { /* the browser plays no sound: the motion goes on without it */ this.url = null; }
        this.since = performance.now();
      }
    }

    pause() { this.at = this.time; this.playing = false; this.audio.pause(); }

    setSpeed(speed) { this.at = this.time; this.speed = speed; this.audio.playbackRate = speed; }
  }

  /* ---- the timeline: curves of the voice, and the phrases of every version ---- */

  class Timeline {
    constructor(canvas, viewer) {
      this.canvas = canvas; this.viewer = viewer;
      const seek = event => {
        const box = canvas.getBoundingClientRect(), share = (event.clientX - box.left - this.left) / (box.width - this.left - 6);
        viewer.seek(share * viewer.clock.duration);
      };
      canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); seek(event); });
      canvas.addEventListener("pointermove", event => { if (event.buttons) seek(event); });
    }

    get left() { return this.canvas.clientWidth < NARROW_PX ? 6 : 132; }

    layout() {
      const rows = this.viewer.figures.filter(figure => figure.version.phrases && figure.on);
      const narrow = this.canvas.clientWidth < NARROW_PX, row = narrow ? 34 : 22;
      const curves = this.viewer.take.curves.length ? 58 : 0;
      this.canvas.style.height = `${Math.max(curves + row * rows.length, 14) + 22}px`;
      return { rows, row, curves, narrow };
    }

    /* Draw everything but the cursor, whenever something changed. */
    draw() {
      if (!this.viewer.take) return;
      const { rows, row, curves, narrow } = this.layout(), scale = window.devicePixelRatio || 1;
      const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
      if (!width) return;
      this.canvas.width = width * scale; this.canvas.height = height * scale;
      const paint = document.createElement("canvas");
      paint.width = this.canvas.width; paint.height = this.canvas.height;
      const pen = paint.getContext("2d"), style = getComputedStyle(this.viewer.element);
      const ink = style.getPropertyValue("--cv-ink"), faint = style.getPropertyValue("--cv-faint"), line = style.getPropertyValue("--cv-line");
      pen.scale(scale, scale);
      pen.font = "12px system-ui, sans-serif"; pen.textBaseline = "middle";
      const duration = this.viewer.clock.duration, x = time => this.left + time / duration * (width - this.left - 6);
      const step = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600].find(s => duration / s <= (width - this.left) / 70) || 1800;
      pen.strokeStyle = line; pen.fillStyle = faint; pen.textAlign = "center";
      for (let time = 0; time <= duration + 1e-6; time += step) {
        pen.beginPath(); pen.moveTo(x(time), 0); pen.lineTo(x(time), height - 18); pen.stroke();
        pen.fillText(words(time, step < 1), Math.min(Math.max(x(time), 18), width - 16), height - 9);
      }
      this.viewer.take.curves.forEach((curve, index) => this.drawCurve(pen, curve, index, x, curves, narrow, index ? faint : ink));
      rows.forEach((figure, index) => this.drawPhrases(pen, figure, curves + row * index, row, x, narrow, ink));
      this.still = paint;
      this.cursor();
    }

    drawCurve(pen, curve, index, x, height, narrow, colour) {
      pen.strokeStyle = colour; pen.lineWidth = index ? 1 : 1.6; pen.beginPath();
      let on = false;
      curve.values.forEach((value, k) => {
        if (value < 0) { on = false; return; }
        const px = x((k + 0.5) * this.viewer.take.curveStep), py = height - 8 - value / CURVE_LEVELS * (height - 16);
        if (on) pen.lineTo(px, py); else pen.moveTo(px, py);
        on = true;
      });
      pen.stroke(); pen.lineWidth = 1;
      if (!narrow) { pen.fillStyle = colour; pen.textAlign = "left"; pen.fillText(curve.title, 4, 14 + 18 * index); }
    }

    drawPhrases(pen, figure, top, row, x, narrow, ink) {
      pen.textAlign = "left"; pen.fillStyle = ink;
      const band = narrow ? top + 15 : top + 3, height = narrow ? row - 18 : row - 6;
      pen.fillText(clipped(pen, figure.version.title, narrow ? 1e9 : this.left - 12), 4, narrow ? top + 8 : top + row / 2);
      for (const [start, end, label] of figure.version.phrases) {
        const from = x(start), width = Math.max(x(end) - from - 1, 1), colour = this.viewer.stage.colours[label] || "#888888";
        pen.fillStyle = colour; pen.fillRect(from, band, width, height);
        if (width > 26) { pen.fillStyle = dark(colour) ? "#ffffff" : "#111111"; pen.fillText(clipped(pen, label.replace(/_/g, " "), width - 6), from + 3, band + height / 2); }
      }
    }

    cursor() {
      if (!this.still) return;
      const pen = this.canvas.getContext("2d"), scale = window.devicePixelRatio || 1;
      pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
      pen.drawImage(this.still, 0, 0);
      const x = this.left + this.viewer.time / this.viewer.clock.duration * (this.canvas.clientWidth - this.left - 6);
      pen.fillStyle = getComputedStyle(this.viewer.element).getPropertyValue("--cv-accent");
      pen.fillRect(x * scale - 1, 0, 2 * scale, this.canvas.height - 18 * scale);
    }
  }

  const words = (time, fine) => `${Math.floor(time / 60)}:${(time % 60).toFixed(fine ? 1 : 0).padStart(fine ? 4 : 2, "0")}`;

  const dark = colour => {
    const [r, g, b] = [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16));
    return 0.299 * r + 0.587 * g + 0.114 * b < 140;
  };

  function clipped(pen, text, width) {
    if (pen.measureText(text).width <= width) return text;
    let short = text;
    while (short.length > 1 && pen.measureText(`${short}…`).width > width) short = short.slice(0, -1);
    return short.length > 1 ? `${short}…` : "";
  }

  /* ---- takes that other scripts bring ---- */

  const received = new Map();

  /* Take what a script brings; its name is that of the script. */
  function receive(source, take) { received.set(source, take); }

  /* Return a take, whose script is loaded first if it was not. */
  function brought(take) {
    if (!take.source) return take;
    if (received.has(take.source)) return received.get(take.source);
    return new Promise((done, failed) => {
      const script = document.createElement("script");
      script.src = take.source;
      script.onload = () => received.has(take.source) ? done(received.get(take.source)) : failed();
      script.onerror = failed;
      document.head.append(script);
    });
  }

  /* ---- motion that arrives while somebody speaks ---- */

  class Live {
    constructor(viewer, controls) {
      this.viewer = viewer; this.delays = []; this.offsets = [];
      this.panel = element("div", { class: "cv-row cv-live" });
      for (const style of controls.styles) this.panel.append(this.slider(style));
      controls.keywords.forEach((word, k) => this.panel.append(this.word(word, k)));
      this.delay = element("output", { class: "cv-time", "aria-label": "Delay" });
      this.panel.append(this.delay);
      viewer.element.querySelector(".cv-bar").after(this.panel);
      this.keywords = controls.keywords;
      const address = new URL(controls.socket, location.href);
      address.protocol = address.protocol.replace("http", "ws");
      this.connect(address.href);
    }

    slider(style) {
      const range = element("input", { type: "range", min: "0", max: "1", step: "0.05", value: "0", "aria-label": style });
      range.addEventListener("change", () => this.send({ name: `style:${style}`, value: Number(range.value) }));
      return element("label", { class: "cv-slider", text: style }, range);
    }

    word(word, k) {
      return this.viewer.button(k < 9 ? `${k + 1} ${word}` : word, `Gesture for ${word}`, () => this.call(k));
    }

    /* Call for the gesture of a keyword. */
    call(k) { if (this.keywords[k] !== undefined) this.send({ name: "keyword", value: this.keywords[k] }); }

    send(message) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message)); }

    connect(address) {
      this.socket = new WebSocket(address);
      this.socket.binaryType = "arraybuffer";
      this.socket.onopen = () => { this.viewer.say(""); this.ask(); };
      this.socket.onclose = () => {
        this.viewer.say("The program that makes the motion has ended or cannot be reached. This page waits for it.");
        setTimeout(() => this.connect(address), 1000);
      };
      this.socket.onmessage = event => typeof event.data === "string" ? this.answer(JSON.parse(event.data)) : this.take(event.data);
    }

    /* Ask for the time of the other clock, which the smallest of some differences tells best. */
    ask() { this.send({ asked: performance.now() }); }

    answer({ asked, now: theirs }) {
      const now = performance.now();
      this.offsets.push({ trip: now - asked, offset: 1000 * theirs - (now + asked) / 2 });
      if (this.offsets.length < 8) setTimeout(() => this.ask(), 50);
      this.offset = this.offsets.reduce((a, b) => a.trip <= b.trip ? a : b).offset;
    }

    take(data) {
      const { version } = this.viewer.figures[0], view = new DataView(data);
      const arrived = 1000 * view.getFloat64(4, true), numbers = new Float32Array(data.slice(12));
      version.root.set(numbers.subarray(0, 3));
      version.turns.set(numbers.subarray(3));
      this.frame = view.getUint32(0, true);
      this.viewer.changed = true;
      requestAnimationFrame(() => this.seen(arrived));
    }

    /* Note the delay of a frame that has been drawn. */
    seen(arrived) {
      if (this.offset === undefined) return;
      this.delays.push(performance.now() + this.offset - arrived);
      if (this.delays.length > 60) this.delays.shift();
      const sorted = [...this.delays].sort((a, b) => a - b);
      this.delay.textContent = `sound to picture ${sorted[sorted.length >> 1].toFixed(0)} ms`;
    }
  }

  /* ---- the viewer ---- */

  /* A grid of squares of half a metre. Its lines are cut at every crossing, since some renderers drop lines that pass
     the camera. */
  function floor() {
    const points = [], half = 20, step = 0.5;
    for (let a = -half; a <= half; a++) for (let b = -half; b < half; b++) {
      points.push(a * step, 0, b * step, a * step, 0, (b + 1) * step, b * step, 0, a * step, (b + 1) * step, 0, a * step);
    }
    const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x888888, transparent: true, opacity: 0.22 }));
  }

  const element = (kind, attributes = {}, ...children) => {
    const made = document.createElement(kind);
    for (const [name, value] of Object.entries(attributes)) {
      if (name === "text") made.textContent = value; else made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  };

  class Viewer {
    constructor(host, stage) {
      this.element = host; this.stage = stage;
      this.takes = []; this.figures = [];
      this.clock = new Clock();
      this.look = "body"; this.trails = false; this.overlaid = false; this.time = 0;
      this.build();
      if (this.startGraphics()) new ResizeObserver(() => this.resize()).observe(this.scene.canvas);
      requestAnimationFrame(() => this.tick());
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.paintBackground(); this.timeline.draw(); });
    }

    build() {
      this.element.classList.add("cv");
      this.element.tabIndex = 0;
      this.element.setAttribute("role", "region");
      this.element.setAttribute("aria-label", "3D viewer");
      this.canvas = element("canvas", { class: "cv-scene", role: "img", "aria-label": "Moving bodies" });
      this.names = element("div", { class: "cv-names", "aria-hidden": "true" });
      this.note = element("p", { class: "cv-note", role: "status", hidden: "" });
      this.choice = element("select", { class: "cv-choice", "aria-label": "Record" });
      this.choice.addEventListener("change", () => this.choose(Number(this.choice.value)));
      this.playButton = this.button("▶", "Play (space)", () => this.toggle());
      this.clockText = element("output", { class: "cv-time" });
      this.speed = element("select", { "aria-label": "Speed" });
      for (const speed of SPEEDS) this.speed.append(element("option", { value: speed, text: `${speed}×` }));
      this.speed.value = "1";
      this.speed.addEventListener("change", () => this.clock.setSpeed(Number(this.speed.value)));
      this.lookChoice = element("select", { "aria-label": "Drawn as" });
      for (const [look, title] of Object.entries(LOOKS)) this.lookChoice.append(element("option", { value: look, text: title }));
      this.lookChoice.addEventListener("change", () => { this.look = this.lookChoice.value; this.changed = true; });
      this.overlayButton = this.button("Overlaid", "Overlay the bodies (o)", () => this.setOverlaid(!this.overlaid));
      this.trailButton = this.button("Trails", "Paths of the hands (t)", () => this.setTrails(!this.trails));
      this.chips = element("div", { class: "cv-chips", role: "group", "aria-label": "Versions" });
      this.scrubber = element("canvas", { class: "cv-timeline", tabindex: "0", role: "slider", "aria-label": "Time", "aria-valuemin": "0" });
      this.timeline = new Timeline(this.scrubber, this);
      const bar = element("div", { class: "cv-bar", role: "toolbar", "aria-label": "Playback" },
        this.playButton,
        this.stepButton("◀︎|", "One frame back (left arrow)", -1), this.stepButton("|▶︎", "One frame on (right arrow)", 1),
        this.clockText, this.speed, this.lookChoice, this.overlayButton, this.trailButton,
        this.button("Front", "View from the front (f)", () => this.view(0)),
        this.button("Side", "View from the left of the bodies (s)", () => this.view(90)));
      this.element.append(element("div", { class: "cv-stage" }, this.canvas, this.names, this.note), bar,
        element("div", { class: "cv-row" }, this.choice, this.chips), this.scrubber,
        this.help = element("p", { class: "cv-help", text: "Drag to turn, scroll to zoom. Space plays, the arrow keys step by frames (with Shift by seconds), 1 to 9 show and hide versions." }));
      this.element.addEventListener("keydown", event => this.key(event));
    }

    stepButton(text, title, frames) {
      const made = this.button(text, title, () => this.step(frames));
      made.className = "cv-step";
      return made;
    }

    /* A button with a hint; one with a symbol instead of a word is read out as its hint. */
    button(text, title, act) {
      const made = element("button", { type: "button", title, text });
      if (!/\w{2}/.test(text)) made.setAttribute("aria-label", title);
      made.addEventListener("click", act);
      return made;
    }

    startGraphics() {
      let renderer;
      try {
        renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true });
      } catch {
        this.say("This browser offers no WebGL, so bodies cannot be drawn in 3D. The sound and the timeline work without it, and so do the videos of a report.");
        this.canvas.hidden = true;
        return false;
      }
      const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(28, 1, 0.01, 1000);
      scene.add(new THREE.HemisphereLight(0xffffff, 0x8d8a86, 2.1));
      const sun = new THREE.DirectionalLight(0xffffff, 1.9);
      sun.position.set(1.2, 2.4, 2.2);
      scene.add(sun);
      const grid = floor();
      scene.add(grid);
      scene.fog = new THREE.Fog(0xffffff, 1, 2);
      const controls = new THREE.OrbitControls(camera, this.canvas);
      controls.addEventListener("change", () => { this.changed = true; });
      this.scene = { renderer, scene, camera, controls, grid, canvas: this.canvas };
      this.paintBackground();
      return true;
    }

    paintBackground() {
      if (!this.scene) return;
      const style = getComputedStyle(this.element);
      this.scene.scene.background = new THREE.Color(style.getPropertyValue("--cv-stage").trim() || "#f3f3f1");
      this.scene.scene.fog.color.copy(this.scene.scene.background);
      this.changed = true;
    }

    say(text) { this.note.textContent = text; this.note.hidden = !text; }

    /* Add a take, or its title and the script that brings it; the first one is shown at once. */
    add(take) {
      this.takes.push(take);
      this.choice.append(element("option", { value: this.takes.length - 1, text: take.title }));
      this.choice.hidden = this.takes.length < 2;
      if (this.takes.length === 1) this.ready = this.choose(0);
    }

    async choose(index) {
      this.choice.value = String(index);
      let take;
      try { take = await brought(this.takes[index]); } catch {
        this.say(`${this.takes[index].source} cannot be loaded. It belongs next to this page.`);
        return;
      }
      if (this.choice.value !== String(index)) return; // another one was chosen while this one was loaded
      if (this.scene) this.say("");
      const versions = await Promise.all(take.versions.map(unpacked));
      for (const figure of this.figures) { this.scene?.scene.remove(figure.group); figure.dispose(); }
      this.take = take;
      this.clock.load(take);
      const few = this.element.clientWidth < NARROW_PX ? 2 : Infinity;
      let shown = 0;
      this.figures = versions.map((version, k) => {
        const figure = new Figure(version, this.stage.surfaces[version.surface], COLOURS[k % COLOURS.length]);
        figure.on = version.shown && shown++ < few;
        this.scene?.scene.add(figure.group);
        return figure;
      });
      this.buildChips();
      this.arrange();
      this.seek(0);
      this.setPlaying(false);
    }

    buildChips() {
      this.chips.replaceChildren(); this.names.replaceChildren();
      this.figures.forEach((figure, k) => {
        const { title, head } = figure.version;
        const chip = this.button(head ? `${title} · head: ${head}` : title, `Show ${figure.version.title}${k < 9 ? ` (${k + 1})` : ""}`, () => this.show(k, !figure.on));
        chip.style.setProperty("--cv-own", COLOURS[k % COLOURS.length]);
        chip.className = "cv-chip"; figure.chip = chip;
        figure.name = element("span", { text: figure.version.title });
        this.names.append(figure.name);
        this.chips.append(chip);
      });
    }

    show(k, on) {
      if (this.figures[k]) { this.figures[k].on = on; this.arrange(); }
    }

    /* Put the visible bodies next to one another, or in one place, and the camera where it sees them. */
    arrange() {
      const on = this.figures.filter(figure => figure.on), wide = figure => figure.extent.high[0] - figure.extent.low[0];
      const slot = Math.max(...on.map(wide), 0.1) * 1.08;
      this.figures.forEach(figure => {
        const place = on.indexOf(figure);
        figure.group.visible = figure.on;
        figure.name.hidden = !figure.on;
        figure.name.style.maxWidth = `${100 / on.length}%`;
        figure.chip.setAttribute("aria-pressed", String(figure.on));
        const middle = (figure.extent.low[0] + figure.extent.high[0]) / 2;
        figure.group.position.x = this.overlaid ? 0 : (place - (on.length - 1) / 2) * slot - middle;
      });
      this.across = this.overlaid ? slot : slot * on.length;
      this.view(0);
      this.timeline.draw();
    }

    /* Look at the bodies from an angle in degrees, measured from the front towards their left. */
    view(angle) {
      const on = this.figures.filter(figure => figure.on);
      if (!this.scene || !on.length) return;
      const { camera, controls, grid } = this.scene;
      const low = Math.min(...on.map(figure => figure.extent.low[1])), high = Math.max(...on.map(figure => figure.extent.high[1]));
      const near = on.map(figure => (figure.extent.low[2] + figure.extent.high[2]) / 2), middle = near.reduce((a, b) => a + b) / near.length;
      const centre = this.overlaid ? on.reduce((sum, figure) => sum + (figure.extent.low[0] + figure.extent.high[0]) / 2, 0) / on.length : 0;
      const half = Math.tan(camera.fov / 2 * Math.PI / 180), tall = 0.6 * (high - low) + 0.02 * this.across;
      const turn = angle * Math.PI / 180, deep = Math.max(...on.map(figure => figure.extent.high[2] - figure.extent.low[2]));
      const depth = 0.5 * (Math.abs(Math.sin(turn)) * this.across + Math.abs(Math.cos(turn)) * deep);
      const distance = Math.max(tall / half, 0.54 * (Math.abs(Math.cos(turn)) * this.across + Math.abs(Math.sin(turn)) * deep) / (half * camera.aspect)) + depth;
      controls.target.set(centre, low + 0.53 * (high - low), middle);
      camera.position.set(centre + distance * Math.sin(turn), low + 0.62 * (high - low), middle + distance * Math.cos(turn));
      camera.near = distance / 200; camera.far = distance * 50;
      camera.updateProjectionMatrix();
      this.scene.scene.fog.near = 1.25 * distance; this.scene.scene.fog.far = 2.6 * distance;
      const step = 10 ** Math.round(Math.log10(high - low || 1)) / 2;
      grid.scale.setScalar(step / 0.5); grid.position.y = low;
      controls.update();
      this.changed = true;
    }

    /* Show poses as they arrive at a websocket. `controls` names the socket, styles and keywords. */
    async follow(take, controls) {
      this.add(take);
      await this.ready;
      this.live = new Live(this, controls);
      for (const part of [this.playButton, this.clockText, this.scrubber, this.speed, this.overlayButton, this.chips.parentElement,
        ...this.element.querySelectorAll(".cv-step")]) part.hidden = true;
      this.help.textContent = "Drag to turn, scroll to zoom." + (controls.keywords.length ? " The keys 1 to 9 call for the gestures of the words." : "");
    }

    setOverlaid(on) {
      this.overlaid = on;
      this.overlayButton.setAttribute("aria-pressed", String(on));
      this.arrange();
    }

    setTrails(on) {
      this.trails = on; this.changed = true;
      this.trailButton.setAttribute("aria-pressed", String(on));
    }

    seek(time) { this.clock.seek(time); this.changed = true; }

    step(frames) {
      this.setPlaying(false);
      const fps = (this.figures.find(figure => figure.on) || this.figures[0]).version.fps;
      const frame = Math.floor(this.clock.at * fps + 1e-6) + frames;
      this.seek((frame + 0.5) / fps);
    }

    toggle() { this.setPlaying(!this.clock.playing); }

    setPlaying(on) {
      if (on) this.clock.play(); else this.clock.pause();
      this.playButton.textContent = on ? "❚❚" : "▶";
      this.playButton.setAttribute("aria-label", on ? "Pause (space)" : "Play (space)");
    }

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
      const acts = {
        " ": () => this.toggle(), ArrowLeft: () => this.step(event.shiftKey ? -this.second : -1),
        ArrowRight: () => this.step(event.shiftKey ? this.second : 1), Home: () => this.seek(0), End: () => this.seek(this.clock.duration),
        o: () => this.setOverlaid(!this.overlaid), t: () => this.setTrails(!this.trails), f: () => this.view(0), s: () => this.view(90),
      };
      if (this.live && /^[1-9]$/.test(event.key)) { this.live.call(event.key - 1); return; }
      const act = acts[event.key] || (/^[1-9]$/.test(event.key) && this.figures[event.key - 1]
        ? () => this.show(event.key - 1, !this.figures[event.key - 1].on) : null);
      if (!act || (event.key === " " && event.target.tagName === "BUTTON")) return;
      event.preventDefault();
      act();
    }

    get second() { return Math.round((this.figures.find(figure => figure.on) || this.figures[0]).version.fps); }

    resize() {
      const { renderer, camera, canvas } = this.scene, width = canvas.clientWidth, height = canvas.clientHeight;
      if (!width || !height) return;
      renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      this.view(0);
      this.timeline.draw();
    }

    tick() {
      requestAnimationFrame(() => this.tick());
      if (!this.take) return;
      const time = this.clock.time;
      if (this.clock.playing && time >= this.clock.duration) { this.setPlaying(false); this.seek(this.clock.duration); }
      if (time === this.time && !this.changed) return;
      this.time = Math.min(time, this.clock.duration); this.changed = false;
      this.drawFrame();
    }

    drawFrame() {
      if (this.scene) this.drawBodies();
      if (!this.live) this.clockText.textContent = `${words(this.time, true)} / ${words(this.clock.duration, false)}`;
      this.scrubber.setAttribute("aria-valuemax", this.clock.duration.toFixed(2));
      this.scrubber.setAttribute("aria-valuenow", this.time.toFixed(2));
      this.scrubber.setAttribute("aria-valuetext", words(this.time, true));
      this.timeline.cursor();
    }

    drawBodies() {
      const { renderer, scene, camera } = this.scene, first = this.figures.findIndex(figure => figure.on);
      this.figures.forEach((figure, k) => { if (figure.on) figure.show(this.time, this.look, this.trails, this.overlaid && k !== first); });
      renderer.render(scene, camera);
      this.placeNames();
    }

    /* The names of the bodies, below their feet; when they are overlaid, the chips say which is which. */
    placeNames() {
      const spot = new THREE.Vector3(), { canvas } = this.scene;
      for (const figure of this.figures) {
        if (!figure.on) continue;
        figure.name.hidden = this.overlaid;
        spot.set((figure.extent.low[0] + figure.extent.high[0]) / 2 + figure.group.position.x, figure.extent.low[1], figure.now.place[2]);
        spot.project(this.scene.camera);
        figure.name.style.transform = `translate(-50%, 0) translate(${(spot.x + 1) / 2 * canvas.clientWidth}px, ${Math.min((1 - spot.y) / 2 * canvas.clientHeight + 6, canvas.clientHeight - figure.name.offsetHeight - 6)}px)`;
      }
    }

    /* Where a joint of a version is seen, in pixels of the scene: for tests and other scripts on the page. */
    seen(version, joint) {
      const figure = this.figures[version], { place } = pose(figure.version, this.time, room(figure.n));
      const spot = new THREE.Vector3().fromArray(place, 3 * joint).add(figure.group.position).project(this.scene.camera);
      return [(spot.x + 1) / 2 * this.canvas.clientWidth, (1 - spot.y) / 2 * this.canvas.clientHeight];
    }
  }

  return { mount: (host, stage) => new Viewer(host, stage), receive };
})();
