/* A trained robot in MuJoCo's wasm: the observation, network, PD law, reset and fall rule of RoboJackson. */
'use strict';
const Dance = (() => {
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const doubles = (text) => new Float64Array(bytes(text));
  /* Numbers as shares of the largest of their row. */
  const shares = (text, largest, width) => Float32Array.from(new Int16Array(bytes(text)), (part, i) => part * largest[Math.floor(i / width)]);

  async function load(zipped) {
    const lacks = ['WebAssembly', 'DecompressionStream'].filter((name) => !(name in globalThis));
    if (lacks.length) throw new Error(`it lacks ${lacks.join(' and ')}; open the page in a newer one`);
    const stream = new Blob([bytes(zipped)]).stream().pipeThrough(new DecompressionStream('gzip'));
    return MUJOCO.default({ wasmBinary: await new Response(stream).arrayBuffer() });
  }

  /* Rows of the matrix of a quaternion wxyz. */
  function matrixOf(q, at) {
    const w = q[at], x = q[at + 1], y = q[at + 2], z = q[at + 3];
    return [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
  }
  /* The transpose of a matrix times a vector: a world vector in the frame of the body. */
  const local = (r, x, y, z) => [r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z];

  /* The points that begin at `places`, relative to the pelvis and turned by minus the heading of a root, as `rollout_score.heading_frame`. */
  function headingFrame(values, places, pelvis, root) {
    const yaw = Math.atan2(root[3], root[0]), c = Math.cos(yaw), s = Math.sin(yaw);
    return places.map((at) => {
      const [x, y, z] = [0, 1, 2].map((k) => values[at + k] - values[places[pelvis] + k]);
      return [c * x + s * y, c * y - s * x, z];
    });
  }

  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const STAGES = [[0.5], [0, 0.5], [0, 0, 1], [1 / 6, 1 / 3, 1 / 3, 1 / 6]], RK4 = 1;

  /* Positions after a velocity has been held for h seconds: a free root, then hinges. */
  function moved(qpos, v, h) {
    const to = Float64Array.from(qpos, (value, k) => (k < 3 ? value + h * v[k] : k < 7 ? value : value + h * v[k - 1]));
    const speed = Math.hypot(v[3], v[4], v[5]), half = (h * speed) / 2, s = speed ? Math.sin(half) / speed : 0;
    const [w, x, y, z] = qpos.slice(3, 7), a = Math.cos(half), b = s * v[3], c = s * v[4], d = s * v[5];
    to.set([w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c, w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a], 3);
    return to;
  }

  /* The rate at which a turn by `turn` grows when a body turns with `v`, both in its own frame. */
  function turning(v, turn) {
    const rate = Float64Array.from(v), n = Math.hypot(...turn), share = n > 1e-4 ? (1 - n / 2 / Math.tan(n / 2)) / (n * n) : 1 / 12;
    const once = cross(turn, v.slice(3, 6)), twice = cross(turn, once);
    for (let k = 0; k < 3; k++) rate[3 + k] += 0.5 * once[k] + share * twice[k];
    return rate;
  }

  /* One step as MuJoCo 4.0 takes it, whose RK4 adds turns in one frame; the wasm's 3.14 adds them in the frame of each stage. */
  function stepOfRungeKutta(mujoco, model, data) {
    mujoco.mj_forward(model, data);
    const h = model.opt.timestep, from = Float64Array.from(data.qpos), speed = Float64Array.from(data.qvel);
    const rates = [speed], forces = [Float64Array.from(data.qacc)];
    const sum = (shares, rows) => speed.map((_, k) => shares.reduce((all, share, i) => all + share * rows[i][k], 0));
    STAGES.forEach((shares, stage) => {
      const rate = sum(shares, rates), force = sum(shares, forces);
      data.qpos.set(moved(from, rate, h)); data.qvel.set(speed.map((value, k) => value + h * force[k]));
      if (stage === STAGES.length - 1) return;
      mujoco.mj_forward(model, data);
      forces.push(Float64Array.from(data.qacc)); rates.push(turning(Float64Array.from(data.qvel), Array.from(rate.slice(3, 6), (value) => h * value)));
    });
    data.qacc_warmstart.set(forces.at(-1));
  }

  /* A number of a normal distribution (Box and Muller). */
  const normal = () => Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());

  /* A value moved to a measured one, by half of the share where that is `doubt` away. */
  function corrected(value, measured, share, doubt) {
    const apart = value.map((from, k) => measured[k] - from), heed = share / (1 + (Math.hypot(...apart) / doubt) ** 2);
    return value.map((from, k) => from + heed * apart[k]);
  }

  /* Height and velocity of the root from what a robot measures, as `rl.sim.leg_odometry`. */
  class Odometry {
    constructor(mujoco, model, rule) {
      Object.assign(this, { model, rule, noise: rule.noise, gravity: model.opt.gravity[2] });
      this.soles = rule.soles.map(([name, centre, radius]) => {
        const body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY.value, name), joints = [];
        for (let up = body; up > 0; up = model.body_parentid[up]) {
          for (let k = 0; k < model.body_jntnum[up]; k++) if (model.body_jntadr[up] + k > 0) joints.push(model.body_jntadr[up] + k);
        }
        return { body, centre, radius, joints };
      });
    }

    begin() { this.last = null; }

    /* Lowest height of each sole point, and its velocity; without that of the root unless `whole`. */
    at(data, qpos, qvel, whole) {
      const own = matrixOf(qpos, 3), spin = [0, 1, 2].map((k) => own[3 * k] * qvel[3] + own[3 * k + 1] * qvel[4] + own[3 * k + 2] * qvel[5]);
      return this.soles.map(({ body, centre, radius, joints }) => {
        const turn = matrixOf(data.xquat, 4 * body), place = [0, 1, 2].map((k) => data.xpos[3 * body + k] + turn[3 * k] * centre[0] + turn[3 * k + 1] * centre[1] + turn[3 * k + 2] * centre[2]);
        place[2] -= radius;
        const speed = cross(spin, place.map((value, k) => value - qpos[k]));
        for (const joint of joints) {
          const arm = place.map((value, k) => value - data.xanchor[3 * joint + k]), move = cross([0, 1, 2].map((k) => data.xaxis[3 * joint + k]), arm);
          for (let k = 0; k < 3; k++) speed[k] += move[k] * qvel[this.model.jnt_dofadr[joint]];
        }
        if (whole) for (let k = 0; k < 3; k++) speed[k] += qvel[k];
        return { height: place[2], speed };
      });
    }

    /* One control step of dt seconds; the path is the state that the feedback keeps the robot in, now. */
    estimate(data, dt, path, ghost) {
      const { rule } = this, { qpos, qvel } = data, own = matrixOf(qpos, 3), inside = cross([3, 4, 5].map((k) => qvel[k]), rule.imu);
      const swing = [0, 1, 2].map((k) => own[3 * k] * inside[0] + own[3 * k + 1] * inside[1] + own[3 * k + 2] * inside[2]);
      const aims = this.at(ghost, path.qpos, path.qvel, true), soles = this.at(data, qpos, qvel, false);
      const floor = Math.min(...soles.map((sole) => sole.height)), carries = soles.map((sole) => Math.exp((floor - sole.height) / rule.low)), all = carries.reduce((a, b) => a + b);
      const measured = [0, 1, 2].map((k) => soles.reduce((sum, sole, i) => sum + carries[i] * (aims[i].speed[k] - sole.speed[k]), 0) / all);
      const felt = [0, 1, 2].map((k) => qvel[k] + swing[k]), height = qpos[2] - floor + Math.min(...aims.map((aim) => aim.height));
      let velocity;
      if (!this.last) {
        velocity = corrected(Array.from(path.qvel.slice(0, 3)), measured, 1, rule.doubt_speed);
      } else {
        const assumed = [0, 0, dt * (this.gravity - this.model.opt.gravity[2])];
        const predicted = felt.map((value, k) => this.last.known[k] + value - this.last.felt[k] + assumed[k] + dt * this.noise * normal() - swing[k]);
        velocity = corrected(predicted, measured, rule.share, rule.doubt_speed);
      }
      this.last = { felt, known: velocity.map((value, k) => value + swing[k]) };
      return { height, velocity };
    }
  }

  class Dancer {
    constructor(mujoco, dance) {
      Object.assign(this, { mujoco, dance, mode: 'policy' });
      this.model = mujoco.MjModel.from_xml_string(dance.xml);
      this.data = new mujoco.MjData(this.model);
      this.ghost = new mujoco.MjData(this.model);
      for (const [name, values] of Object.entries(dance.numbers)) this.model[name].set(doubles(values));
      const { nq, nv, nu } = this.model;
      Object.assign(this, { nq, nv, nu });
      for (const name of ['qpos', 'qvel', 'points', 'lead']) this[name] = dance[name] && doubles(dance[name]);
      this.preview = dance.preview && new Float32Array(bytes(dance.preview));
      this.steps = this.qpos.length / nq;
      if (dance.feedback) {
        const { gain, step, offset, qpos, qvel } = dance.feedback;
        this.feedback = { gain: shares(gain, new Float32Array(bytes(step)), 2 * nv), offset: doubles(offset), qpos: doubles(qpos), qvel: doubles(qvel), apart: new Float64Array(2 * nv) };
        if (dance.feedback.places) this.feedback.places = doubles(dance.feedback.places);
        if (dance.feedback.odometry) this.odometry = new Odometry(mujoco, this.model, dance.feedback.odometry);
      }
      this.layers = dance.layers.map(({ weight, bias, inputs }) => ({ inputs, weight: new Float32Array(bytes(weight)), bias: new Float32Array(bytes(bias)) }));
      this.sites = dance.sites.map((name) => mujoco.mj_name2id(this.model, mujoco.mjtObj.mjOBJ_SITE.value, name));
      const rk4 = (this.model.opt.integrator.value ?? this.model.opt.integrator) === RK4;
      this.substep = rk4 ? (model, data) => stepOfRungeKutta(mujoco, model, data) : mujoco.mj_step;
      this.friction = ['geom_friction', 'pair_friction'].map((name) => [name, Float64Array.from(this.model[name])]);
      this.gravity = this.model.opt.gravity[2];
      this.last = new Float64Array(nu); this.targets = new Float64Array(nu);
      this.start(0);
    }

    /* The reference at a step: its row and how far the cycles before have moved it. */
    at(step) {
      const { cyclic, offset } = this.dance, cycle = cyclic ? Math.floor(step / this.steps) : 0;
      return { row: cyclic ? step - cycle * this.steps : Math.min(step, this.steps - 1), moved: offset.map((by) => by * cycle) };
    }

    state(step) {
      const { row, moved } = this.at(step), qpos = this.qpos.slice(row * this.nq, (row + 1) * this.nq);
      for (let k = 0; k < 3; k++) qpos[k] += moved[k];
      return { qpos, qvel: this.qvel.slice(row * this.nv, (row + 1) * this.nv) };
    }

    start(step, state = this.state(step)) {
      this.mujoco.mj_resetData(this.model, this.data);
      this.data.qpos.set(state.qpos); this.data.qvel.set(state.qvel);
      this.mujoco.mj_forward(this.model, this.data);
      this.odometry?.begin();
      this.step = this.first = step; this.last.fill(0); this.fallen = false; this.error = 0; this.danced = 0;
    }

    observe() {
      const { dance, nq, nv, nu } = this, { qpos, qvel, site_xpos: sites } = this.data;
      const { row, moved } = this.at(this.step + 1), aim = row * nq, aimSpeed = row * nv;
      const own = matrixOf(qpos, 3), target = matrixOf(this.qpos, aim + 3), seen = [], put = (...values) => seen.push(...values);
      const turned = [0, 1].flatMap((k) => local(own, target[k], target[3 + k], target[6 + k]));
      const gyro = () => { for (let k = 3; k < 6; k++) put(qvel[k] * dance.scales.gyro); };
      const speeds = (values, from) => { for (let k = 6; k < nv; k++) put(values[from + k] * dance.scales.hinge); };
      const done = () => { for (let k = 0; k < nu; k++) put(this.last[k] * 0.5); };
      const upright = () => put(qpos[2] - dance.scales.height, own[6], own[7], own[8], ...local(own, qvel[0], qvel[1], qvel[2]));
      const phase = () => { const angle = (2 * Math.PI * row) / this.steps; put(Math.sin(angle), Math.cos(angle)); };
      const place = () => put(...local(own, ...[0, 1, 2].map((k) => this.qpos[aim + k] + moved[k] - qpos[k])).map((value) => value * dance.scales.root));
      const travel = () => put(...local(own, this.qvel[aimSpeed], this.qvel[aimSpeed + 1], this.qvel[aimSpeed + 2]));
      const points = () => this.sites.forEach((site, i) => {
        const from = 3 * (row * this.sites.length + i);
        const apart = [0, 1, 2].map((k) => this.points[from + k] + moved[k] - sites[3 * site + k]);
        put(...local(own, ...apart).map((value) => value * dance.scales.point));
      });
      if (dance.observation === 'full') {
        upright(); gyro();
        for (let k = 7; k < nq; k++) put(qpos[k]);
        speeds(qvel, 0); phase(); place(); put(...turned);
        for (let k = 7; k < nq; k++) put(this.qpos[aim + k] - qpos[k]);
        speeds(this.qvel, aimSpeed); travel(); points(); done();
      } else {
        gyro(); put(...turned);
        for (let k = 7; k < nq; k++) put(qpos[k] - dance.rest[k - 7]);
        speeds(qvel, 0);
        for (let k = 7; k < nq; k++) put(this.qpos[aim + k] - dance.rest[k - 7]);
        speeds(this.qvel, aimSpeed); done();
        const ahead = this.preview ? this.preview.length / this.steps : 0;
        for (let k = 0; k < ahead; k++) put(this.preview[row * ahead + k]);
        if (dance.observation === 'full_preview') { upright(); phase(); place(); travel(); points(); }
      }
      return Float32Array.from(seen, (value) => Math.min(dance.scales.clip, Math.max(-dance.scales.clip, value)));
    }

    act(observation) {
      let values = observation;
      this.layers.forEach(({ inputs, weight, bias }, index) => {
        const out = Float32Array.from(bias), width = out.length, isLast = index === this.layers.length - 1;
        for (let i = 0; i < inputs; i++) {
          const value = values[i];
          if (value !== 0) for (let j = 0, at = i * width; j < width; j++, at++) out[j] += value * weight[at];
        }
        for (let j = 0; j < width; j++) out[j] = isLast ? Math.tanh(out[j]) : Math.max(0, out[j]);
        values = out;
      });
      return values;
    }

    /* How the feedback along the reference moves a target, as `feedback.StepFeedback`. */
    correct() {
      const { nq, nv, nu, feedback } = this, { qpos, qvel } = this.data, { row, moved } = this.at(this.step), { apart, gain } = feedback;
      const from = row * nq, own = feedback.qpos;
      for (let k = 0; k < 3; k++) apart[k] = qpos[k] - own[from + k] - moved[k];
      if (feedback.places) this.aside(row, moved).forEach((by, k) => { apart[k] -= by; });
      const [w, x, y, z] = [3, 4, 5, 6].map((k) => qpos[k]), [a, b, c, d] = [3, 4, 5, 6].map((k) => own[from + k]);
      let turn = [a * w + b * x + c * y + d * z, a * x - b * w - c * z + d * y, a * y + b * z - c * w - d * x, a * z - b * y + c * x - d * w];
      if (turn[0] < 0) turn = turn.map((value) => -value);
      const sine = Math.hypot(turn[1], turn[2], turn[3]), factor = sine > 1e-12 ? (2 * Math.atan2(sine, turn[0])) / sine : 2;
      for (let k = 0; k < 3; k++) apart[3 + k] = factor * turn[1 + k];
      for (let k = 6; k < nv; k++) apart[k] = qpos[k + 1] - own[from + k + 1];
      for (let k = 0; k < nv; k++) apart[nv + k] = qvel[k] - feedback.qvel[row * nv + k];
      if (this.odometry) {
        const { height, velocity } = this.known();
        apart[2] += height - qpos[2];
        for (let k = 0; k < 3; k++) apart[nv + k] += velocity[k] - qvel[k];
      }
      return Float64Array.from({ length: nu }, (_, k) => {
        let sum = feedback.offset[row * nu + k];
        for (let i = 0, at = (row * nu + k) * 2 * nv; i < 2 * nv; i++, at++) sum += gain[at] * apart[i];
        const most = this.dance.feedback.limit[k];
        return -Math.min(most, Math.max(-most, sum));
      });
    }

    /* Height and velocity of the root as the robot knows them. */
    known() {
      const { nq, nv, feedback } = this, { row, moved } = this.at(this.step);
      const qpos = feedback.qpos.slice(row * nq, (row + 1) * nq), qvel = feedback.qvel.slice(row * nv, (row + 1) * nv);
      for (let k = 0; k < 3; k++) qpos[k] += moved[k];
      this.ghost.qpos.set(qpos);
      this.mujoco.mj_kinematics(this.model, this.ghost);
      return this.odometry.estimate(this.data, this.dance.dt, { qpos, qvel }, this.ghost);
    }

    /* How far the feet that stand are from their places in the plane of the floor, as `standing_feet.Feet`. */
    aside(row, moved) {
      const { feet } = this.dance.feedback, { places } = this.feedback, at = this.data.site_xpos;
      const sites = feet.map((foot) => this.sites[foot]), floor = Math.min(...sites.map((site) => at[3 * site + 2]));
      const low = sites.map((site) => Math.exp((floor - at[3 * site + 2]) / this.dance.feedback.low)), all = low.reduce((a, b) => a + b);
      return [0, 1].map((k) => sites.reduce((sum, site, i) => sum + low[i] * (at[3 * site + k] - places[3 * (row * feet.length + i) + k] - moved[k]), 0) / all);
    }

    /* One control step, as `Simulation.step`; false where the robot has fallen. */
    advance() {
      const { mujoco, model, data, dance, nu } = this, { row } = this.at(this.mode === 'statue' ? this.first : this.step + 1);
      const action = this.mode === 'policy' && this.layers.length ? this.act(this.observe()) : new Float32Array(nu);
      const moves = this.feedback && this.mode === 'policy' ? this.correct() : new Float64Array(nu);
      for (let k = 0; k < nu; k++) {
        const lead = this.lead && this.mode !== 'statue' ? this.lead[row * nu + k] : 0;
        this.targets[k] = this.qpos[row * this.nq + 7 + dance.hinge[k]] + lead + moves[k] + dance.action[k] * action[k];
        this.last[k] = action[k];
      }
      for (let substep = 0; substep < dance.substeps; substep++) {
        const { qpos, qvel, ctrl } = data;
        for (let k = 0; k < nu; k++) {
          const torque = dance.kp[k] * (this.targets[k] - qpos[7 + dance.hinge[k]]) - dance.kd[k] * qvel[6 + dance.hinge[k]];
          ctrl[k] = Math.min(dance.limit[k], Math.max(-dance.limit[k], torque)) / dance.gear[k];
        }
        this.substep(model, data);
      }
      mujoco.mj_kinematics(model, data);
      this.step += 1;
      this.#measure();
      return !this.fallen;
    }

    #measure() {
      const { fall } = this.dance, { qpos, site_xpos: sites } = this.data, aim = this.state(this.step).qpos;
      const up = matrixOf(qpos, 3), target = matrixOf(aim, 3), along = up[2] * target[2] + up[5] * target[5] + up[8] * target[8];
      const low = fall.relative ? Math.abs(qpos[2] - aim[2]) > fall.height : qpos[2] < fall.height;
      this.fallen ||= low || (fall.relative ? along : up[8]) < fall.cosTilt || !Number.isFinite(qpos[2]);
      const { row } = this.at(this.step), count = this.sites.length, { pelvis } = this.dance;
      const here = headingFrame(sites, this.sites.map((site) => 3 * site), pelvis, up);
      const there = headingFrame(this.points, this.sites.map((_, i) => 3 * (row * count + i)), pelvis, target);
      this.error = here.reduce((sum, point, i) => sum + Math.hypot(...point.map((value, k) => value - there[i][k])), 0) / count;
      if (!this.fallen) this.danced += 1;
    }

    push(x, y) { this.data.qvel[0] += x; this.data.qvel[1] += y; }
    setFriction(factor) { for (const [name, values] of this.friction) this.model[name].set(values.map((value) => value * factor)); }
    setGravity(factor) { this.model.opt.gravity[2] = this.gravity * factor; }

    /* Rows of x y z qw qx qy qz a body. */
    poses(data = this.data) {
      const { xpos, xquat } = data, rows = new Float32Array(7 * this.model.nbody);
      for (let i = 0; i < this.model.nbody; i++) {
        for (let k = 0; k < 3; k++) rows[7 * i + k] = xpos[3 * i + k];
        for (let k = 0; k < 4; k++) rows[7 * i + 3 + k] = xquat[4 * i + k];
      }
      return rows;
    }

    ghostPoses() {
      this.ghost.qpos.set(this.state(this.step).qpos);
      this.mujoco.mj_kinematics(this.model, this.ghost);
      return this.poses(this.ghost);
    }

    /* Largest distance, millimetres, of a body from where Python's MuJoCo has it after a recorded start. */
    deviation(record) {
      const keep = this.mode, quiet = this.odometry; this.mode = 'policy';
      if (quiet) quiet.noise = 0;
      this.start(record.step, { qpos: Float64Array.from(record.qpos), qvel: Float64Array.from(record.qvel) });
      for (let k = 0; k < record.steps; k++) this.advance();
      const { xpos } = this.data;
      let most = 0;
      for (let i = 0; i < record.places.length; i += 3) most = Math.max(most, Math.hypot(...[0, 1, 2].map((k) => xpos[3 + i + k] - record.places[i + k])));
      this.mode = keep;
      if (quiet) quiet.noise = quiet.rule.noise;
      return 1000 * most;
    }
  }
  return { load, Dancer };
})();
if (typeof module !== 'undefined') module.exports = Dance;
