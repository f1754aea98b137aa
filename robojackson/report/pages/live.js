/* The page of a live dance: MuJoCo steps in real time, pointer and sliders disturb it. */
'use strict';
(async () => {
  const $ = (id) => document.getElementById(id), T = THREE, node = $('live');
  const dance = JSON.parse($('dance-data').textContent);
  const view = new Stage.Panes($('stage'), [$('pane')], $('orbit')), [pane] = view.panes, { materials } = view;
  if (!view.renderer) throw new Error('it draws no 3D (WebGL); turn on hardware acceleration or open the page in another one');
  const robot = Stage.robot(dance.shape, materials.trained, materials.shadow, view.software);
  const ghost = Stage.robot(dance.shape, materials.ghost, null, view.software);
  ghost.group.visible = false;
  pane.scene.add(robot.group, ghost.group);
  Object.assign(pane, { height: dance.height, width: dance.width });
  const pull = new T.Line(new T.BufferGeometry().setAttribute('position', new T.BufferAttribute(new Float32Array(6), 3)), new T.LineBasicMaterial({ color: 0xe11d48 }));
  pull.visible = false; pull.frustumCulled = false; pane.scene.add(pull);

  const mujoco = await Dance.load(dance.wasm);
  delete dance.wasm;
  const dancer = new Dance.Dancer(mujoco, dance), state = { playing: !matchMedia('(prefers-reduced-motion: reduce)').matches, speed: 1, follow: true, drawn: 0, steps: 0 };
  const seconds = (steps) => `${(steps * dance.dt).toFixed(1)} s`;

  /* What the badge says: recorded starts, simulated here as well, end where Python's MuJoCo ended. */
  function check(count) {
    const worst = Math.max(...dance.records.slice(0, count).map((record) => dancer.deviation(record)));
    const follows = worst <= dance.tolerance;
    $('badge').textContent = follows ? `physics as in Python: ${worst.toFixed(2)} mm apart after ${dance.substeps * dance.records[0].steps} steps`
      : `physics differs from Python's by ${worst.toFixed(0)} mm: not what was evaluated`;
    $('badge').classList.toggle('good', follows); $('badge').classList.toggle('bad', !follows);
    return worst;
  }

  function again() {
    dancer.start(Number($('phase').value)); clock = 0; $('fallen').hidden = true; show();
  }
  function push(angle = Math.random() * 2 * Math.PI) {
    const strength = Number($('strength').value);
    dancer.push(strength * Math.cos(angle), strength * Math.sin(angle));
  }

  const held = { body: 0, point: new T.Vector3(), aim: new T.Vector3(), plane: new T.Plane() };
  const ray = new T.Raycaster(), pointer = new T.Vector2();
  function aimAt(event) {
    const box = pane.element.getBoundingClientRect();
    pointer.set((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    view.aim(pane); pane.camera.updateMatrixWorld(); ray.setFromCamera(pointer, pane.camera);
  }
  /* Where the held point of a body is now, from its place in the frame of the body. */
  function heldAt() {
    const { xpos, xmat } = dancer.data, b = held.body, p = held.point.toArray();
    return [0, 1, 2].map((r) => xpos[3 * b + r] + [0, 1, 2].reduce((sum, c) => sum + xmat[9 * b + 3 * r + c] * p[c], 0));
  }
  $('orbit').addEventListener('pointerdown', (event) => {
    aimAt(event);
    const [hit] = ray.intersectObjects(robot.parts);
    if (!hit) return;
    event.stopPropagation(); event.preventDefault(); node.focus({ preventScroll: true, focusVisible: false });
    held.body = hit.object.userData.body;
    const { xpos, xmat } = dancer.data, b = held.body, off = hit.point.toArray().map((value, k) => value - xpos[3 * b + k]);
    held.point.set(...[0, 1, 2].map((c) => [0, 1, 2].reduce((sum, r) => sum + xmat[9 * b + 3 * r + c] * off[r], 0)));
    held.plane.setFromNormalAndCoplanarPoint(pane.camera.getWorldDirection(new T.Vector3()), hit.point);
    held.aim.copy(hit.point); pull.visible = true;
    $('orbit').setPointerCapture(event.pointerId);
  }, { capture: true });
  /* A finger on the robot pulls it; beside it, it scrolls the page. */
  $('orbit').addEventListener('touchstart', (event) => { if (pull.visible) event.preventDefault(); }, { passive: false });
  $('orbit').addEventListener('pointermove', (event) => {
    if (!pull.visible) return;
    event.stopPropagation(); aimAt(event); ray.ray.intersectPlane(held.plane, held.aim);
  }, { capture: true });
  for (const end of ['pointerup', 'pointercancel']) $('orbit').addEventListener(end, () => { pull.visible = false; dancer.data.xfrc_applied.fill(0); }, { capture: true });
  function drag() {
    if (!pull.visible) return;
    const from = heldAt(), { xipos, xfrc_applied: force } = dancer.data, b = held.body;
    let f = held.aim.toArray().map((value, k) => dance.stiffness * (value - from[k]));
    const size = Math.hypot(...f), most = dance.strongest;
    if (size > most) f = f.map((value) => (value * most) / size);
    const arm = from.map((value, k) => value - xipos[3 * b + k]);
    force.fill(0);
    force.set([...f, arm[1] * f[2] - arm[2] * f[1], arm[2] * f[0] - arm[0] * f[2], arm[0] * f[1] - arm[1] * f[0]], 6 * b);
    pull.geometry.attributes.position.array.set([...from, ...held.aim.toArray()]);
    pull.geometry.attributes.position.needsUpdate = true;
  }

  function show() {
    robot.pose(dancer.poses());
    if (ghost.group.visible) ghost.pose(dancer.ghostPoses());
    const { qpos } = dancer.data, target = state.follow ? qpos : dancer.qpos;
    const ease = clock === 0 ? 1 : 0.12;
    pane.target.x += ease * (target[0] - pane.target.x); pane.target.y += ease * (target[1] - pane.target.y);
    /* Where the robot lies, the camera looks down to it. */
    const level = pane.height * 0.5 - 0.06, low = state.follow && !ghost.group.visible ? Math.max(0, dancer.qpos[2] - qpos[2]) : 0;
    pane.target.z += ease * (Math.max(level / 3, level - low) - pane.target.z);
    $('danced').textContent = seconds(dancer.danced); $('error').textContent = `${Math.round(1000 * dancer.error)} mm`;
    $('fallen').hidden = !dancer.fallen; $('again').classList.toggle('primary', dancer.fallen);
    view.draw();
  }
  let clock = 0, before = 0, behind = 0, since = 0, danced = 0;
  function loop(now) {
    const passed = Math.min(0.1, (now - before) / 1000);
    before = now;
    if (state.playing) {
      behind += passed * state.speed;
      const until = performance.now() + 60;
      while (behind >= dance.dt && performance.now() < until) {
        drag(); dancer.advance(); behind -= dance.dt; clock += 1; danced += dance.dt; state.steps += 1;
      }
      behind = Math.min(behind, dance.dt);
      if (!dance.cyclic && dancer.step >= dancer.steps - 1) again();
      show();
    }
    if (view.render()) state.drawn += 1;
    if (now - since > 1000) {
      const share = (100 * danced) / ((now - since) / 1000) / state.speed;
      $('rate').textContent = state.playing ? `${Math.min(100, Math.round(share))}%` : '–';
      since = now; danced = 0;
    }
    requestAnimationFrame(loop);
  }

  const press = (id, on) => $(id).setAttribute('aria-pressed', String(on));
  const label = () => { $('play').textContent = state.playing ? 'Pause' : 'Play'; };
  const play = () => { state.playing = !state.playing; label(); };
  const flipGhost = () => { ghost.group.visible = !ghost.group.visible; press('ghost', ghost.group.visible); show(); };
  const flipFollow = () => { state.follow = !state.follow; press('follow', state.follow); };
  const setMode = (mode) => { $('mode').value = mode; dancer.mode = mode; again(); };
  const modes = ['policy', 'reference', 'statue'];
  const slide = {
    speed: (value) => { state.speed = value; return `${value}×`; },
    friction: (value) => { dancer.setFriction(value); return `${value}×`; },
    gravity: (value) => { dancer.setGravity(value); return `${value}×`; },
    strength: (value) => `${value} m/s`,
    phase: (value) => { again(); return seconds(value); },
  };
  for (const [id, act] of Object.entries(slide)) $(id).addEventListener('input', (event) => { $(`${id}-value`).textContent = act(Number(event.target.value)); });
  const buttons = {
    play, again, push: () => push(), ghost: flipGhost, follow: flipFollow, front: () => view.look(0), side: () => view.look(Math.PI / 2),
    nearer: () => view.zoom(0.85), farther: () => view.zoom(1 / 0.85),
  };
  for (const [id, act] of Object.entries(buttons)) $(id).addEventListener('click', act);
  $('mode').addEventListener('change', (event) => setMode(event.target.value));
  const slow = () => { $('speed').value = state.speed === 1 ? 0.2 : 1; $('speed').dispatchEvent(new Event('input')); };
  const keys = {
    ' ': play, r: again, p: () => push(), g: flipGhost, f: flipFollow, s: slow, o: () => setMode(modes[(modes.indexOf(dancer.mode) + 1) % 3]),
    a: () => view.turn(-0.2, 0), d: () => view.turn(0.2, 0), w: () => view.turn(0, -0.12), x: () => view.turn(0, 0.12), '+': buttons.nearer, '-': buttons.farther,
  };
  document.addEventListener('keydown', (event) => {
    if (event.target !== document.body && !node.contains(event.target)) return;
    if (event.ctrlKey || event.metaKey || event.altKey || ['SELECT', 'INPUT'].includes(event.target.tagName)) return;
    if (['BUTTON', 'SUMMARY'].includes(event.target.tagName) && event.key === ' ') return;
    const act = keys[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  view.measure(); label(); again();
  node.dataset.ready = 'yes';
  window.robojackson = { dancer, dance, state, view, check, again, push, held, drag, show };
  before = since = await new Promise(requestAnimationFrame);
  check(dance.checked); again(); node.dataset.checked = 'yes'; requestAnimationFrame(loop);
})().catch((error) => {
  const badge = document.getElementById('badge');
  badge.textContent = `this browser cannot run the dance: ${error.message}`; badge.classList.add('bad');
  console.error(error);
});
