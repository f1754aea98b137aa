/* The player of a run: the source's video is the clock, all panes and curves go by its picture. */
'use strict';
/* What this page needs of a video, by the computer's clock: for a film that the browser cannot decode. */
class Clock extends EventTarget {
  constructor(seconds, at, rate) { super(); Object.assign(this, { seconds, at, rate, paused: true, muted: true, since: 0 }); }
  get currentTime() { return this.paused ? this.at : (this.at + (this.rate * (performance.now() - this.since)) / 1000) % this.seconds; }
  set currentTime(seconds) { this.at = seconds; this.since = performance.now(); }
  get playbackRate() { return this.rate; }
  set playbackRate(rate) { this.currentTime = this.currentTime; this.rate = rate; }
  async play() { this.since = performance.now(); this.paused = false; this.dispatchEvent(new Event('play')); }
  pause() { this.at = this.currentTime; this.paused = true; this.dispatchEvent(new Event('pause')); }
}
(() => {
  const node = document.getElementById('player');
  if (!node) return;
  const data = JSON.parse(document.getElementById('player-data').textContent);
  const $ = (id) => document.getElementById(id);
  const video = $('source'), seek = $('seek'), { count, fps } = data, state = { picture: 0, drawn: -1, target: null };
  const T = THREE;
  let clock = video, runs = false;

  video.src = URL.createObjectURL(new Blob([Stage.bytes(data.video)], { type: 'video/mp4' }));
  delete data.video;

  const tracks = ['body', 'reference', 'trained'].filter((name) => data[name]);
  const elements = tracks.map((name) => $(`pane-${name}`));
  const view = new Stage.Panes($('stage'), elements, $('orbit'));
  const { materials } = view;
  $('flat').hidden = Boolean(view.renderer);
  const figures = {}, ghost = data.trained && Stage.robot(data.robot, materials.ghost, null, view.software);
  tracks.forEach((name, i) => {
    const pane = view.panes[i], track = data[name];
    track.at = Stage.floats(track.target);
    track.values = Stage.floats(track.poses ?? track.points);
    track.row = track.values.length / count;
    track.wide = Stage.floats(track.widths);
    figures[name] = name === 'body' ? Stage.person(data.person, materials, materials.shadow, view.software)
      : Stage.robot(data.robot, materials[name], materials.shadow, view.software);
    pane.scene.add(figures[name].group);
    Object.assign(pane, { track, height: track.height, width: track.wide[0] });
    if (name === 'trained') pane.scene.add(ghost.group);
  });
  if (ghost) ghost.group.visible = false;
  let follow = true, held = false;

  function show(picture) {
    state.picture = picture;
    if (picture === state.target) state.target = null;
    tracks.forEach((name, i) => {
      const pane = view.panes[i], { track } = pane, at = follow ? picture : 0;
      figures[name].pose(track.values, picture * track.row);
      pane.target.set(track.at[2 * at], track.at[2 * at + 1], track.height * 0.5 - 0.06);
      pane.width = track.wide[picture];
    });
    if (ghost?.group.visible) ghost.pose(data.reference.values, picture * data.reference.row);
    if (!held) seek.value = picture;
    const seconds = picture / fps;
    seek.setAttribute('aria-valuetext', `${seconds.toFixed(2)} s`);
    $('clock').textContent = `${seconds.toFixed(2)} s`;
    $('head').style.left = `${(100 * (picture + 0.5)) / count}%`;
    if ($('ended')) $('ended').hidden = picture < data.ended;
    curves.forEach((curve) => curve.setCursor({ left: curve.valToPos(seconds, 'x'), top: -10 }, false));
    view.draw();
  }

  /* Pictures and panes change together: at the moment a picture of the video is presented. */
  const pictureAt = (seconds) => Math.min(count - 1, Math.max(0, Math.floor(seconds * fps + 1e-3)));
  const presented = (now, frame) => {
    state.video = pictureAt(frame.mediaTime + 0.5 / fps);
    show(state.video); draw();
    video.requestVideoFrameCallback(presented);
  };
  if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(presented);
  else video.addEventListener('seeked', () => show(pictureAt(video.currentTime)));

  let frames = 0, since = performance.now();
  function draw() {
    if (!view.render()) return;
    state.drawn = state.picture; frames += 1;
  }
  function loop(now) {
    if (clock !== video) {
      const picture = pictureAt(clock.currentTime);
      if (picture !== state.picture) show(picture);
    } else if (!video.requestVideoFrameCallback && !video.paused) show(pictureAt(video.currentTime));
    draw();
    if (now - since > 1000) { state.rate = (1000 * frames) / (now - since); frames = 0; since = now; }
    requestAnimationFrame(loop);
  }

  /* While it stands, the next step counts from where it is going: the picture there may be yet to come. */
  const go = (picture) => {
    const target = Math.min(count - 1, Math.max(0, picture));
    state.target = clock.paused ? target : null;
    clock.currentTime = (target + 0.5) / fps;
  };
  const start = () => { runs = true; return clock.play(); };
  const halt = () => { runs = false; clock.pause(); };
  const step = (by) => { halt(); go((state.target ?? state.picture) + by); };
  const toggle = () => (clock.paused ? start() : halt());
  const press = (id, on) => $(id).setAttribute('aria-pressed', String(on));
  const setSpeed = (value) => { $('speed').value = value; clock.playbackRate = Number(value); };
  const flip = {
    follow() { follow = !follow; press('follow', follow); show(state.picture); },
    ghost() {
      if (!ghost) return;
      ghost.group.visible = !ghost.group.visible; press('ghost', ghost.group.visible); show(state.picture);
    },
    sound() {
      if (!$('sound')) return;
      video.muted = !video.muted; $('sound').classList.toggle('primary', video.muted);
      $('sound').textContent = video.muted ? 'Sound on' : 'Sound off';
    },
  };
  function label() {
    $('play').textContent = clock.paused ? 'Play' : 'Pause';
    if (!clock.paused) state.target = null;
  }
  const heed = () => ['play', 'pause'].forEach((change) => clock.addEventListener(change, label));
  heed();
  video.addEventListener('error', () => {
    clock = new Clock(count / fps, state.picture / fps, Number($('speed').value));
    $('undecoded').hidden = false;
    if ($('sound')) $('sound').disabled = true;
    heed(); if (runs) clock.play();
  }, { once: true });
  const buttons = {
    play: toggle, back: () => step(-1), next: () => step(1), follow: flip.follow, ghost: flip.ghost, sound: flip.sound,
    front: () => view.look(0), side: () => view.look(Math.PI / 2), top: () => view.look(0, 0.2),
    nearer: () => view.zoom(0.85), farther: () => view.zoom(1 / 0.85),
  };
  for (const [id, act] of Object.entries(buttons)) $(id)?.addEventListener('click', act);
  seek.addEventListener('pointerdown', () => { held = true; });
  for (const end of ['pointerup', 'pointercancel']) addEventListener(end, () => { held = false; }, { capture: true });
  seek.addEventListener('input', () => { halt(); go(Number(seek.value)); });
  $('speed').addEventListener('change', (event) => setSpeed(event.target.value));
  const keys = {
    ' ': toggle, k: toggle, ArrowLeft: () => step(-1), ArrowRight: () => step(1), ',': () => step(-1), '.': () => step(1),
    j: () => step(-Math.round(fps)), l: () => step(Math.round(fps)), Home: () => go(0), End: () => go(count - 1),
    f: flip.follow, g: flip.ghost, m: flip.sound, s: () => setSpeed(clock.playbackRate === 1 ? '0.25' : '1'),
    a: () => view.turn(-0.2, 0), d: () => view.turn(0.2, 0), w: () => view.turn(0, -0.12), x: () => view.turn(0, 0.12),
    '+': buttons.nearer, '-': buttons.farther, 1: buttons.front, 2: buttons.side, 3: buttons.top,
  };
  document.addEventListener('keydown', (event) => {
    /* Home and End belong to the page until the player is in focus. */
    if (event.target === document.body ? ['Home', 'End'].includes(event.key) : !node.contains(event.target)) return;
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === 'SELECT') return;
    if (['BUTTON', 'SUMMARY'].includes(event.target.tagName) && event.key === ' ') return;
    const act = keys[event.key];
    if (act) { event.preventDefault(); act(); }
  });

  /* Curves over time with a cursor that follows. */
  const seconds = Float64Array.from({ length: count }, (_, i) => i / fps), curves = [];
  const column = (text, index, width) => { const all = Stage.floats(text); return Array.from(seconds, (_, i) => all[i * width + index]); };
  /* What a rollout has after its end is its last pose: not shown. */
  const danced = (values) => values.map((value, i) => (i < data.ended ? value : null));
  function plot(id, label, unit, series) {
    const host = $(id);
    if (!host) return null;
    host.replaceChildren();
    const colour = (name) => Stage.css(name), axis = { stroke: colour('--soft'), grid: { stroke: colour('--line'), width: 1 }, ticks: { stroke: colour('--line') }, font: '12px system-ui' };
    const made = new uPlot({
      width: Math.max(200, host.clientWidth), height: 190, legend: { show: false }, scales: { x: { time: false } },
      axes: [{ ...axis, values: (u, ticks) => ticks.map((tick) => `${tick} s`) }, { ...axis, size: 66, values: (u, ticks) => ticks.map((tick) => `${tick} ${unit}`) }],
      cursor: { y: false, points: { size: 7 }, drag: { x: false, y: false } },
      series: [{}, ...series.map(({ name, stroke, dash }) => ({ label: name, stroke: colour(stroke), width: 2, dash }))],
    }, [seconds, ...series.map(({ values }) => values)], host);
    /* By the place of the click: the cursor follows the dance while it plays. */
    made.over.addEventListener('click', (event) => {
      halt(); go(Math.round(made.posToVal(event.clientX - made.over.getBoundingClientRect().left, 'x') * fps));
    });
    host.setAttribute('aria-label', label);
    return made;
  }
  function plotAll() {
    curves.splice(0).forEach((curve) => curve.destroy());
    const joint = Number($('joint').value), n = data.joints.length, name = data.joints[joint];
    const angles = [{ name: 'reference', stroke: '--curve-reference', values: column(data.angles, joint, n), dash: [6, 4] }];
    if (data.trained) angles.push({ name: 'robot', stroke: '--accent', values: danced(column(data.trained_angles, joint, n)) });
    curves.push(plot('plot-angle', `Angle of ${name} over time, degrees`, '°', angles));
    if (data.torque) curves.push(plot('plot-torque', `Torque that the reference asks of ${name}, per cent of the limit`, '%', [
      { name: 'torque', stroke: '--warm', values: column(data.torque, joint, n) },
      { name: 'limit', stroke: '--curve-reference', values: seconds.map(() => 100), dash: [3, 5] }]));
    if (data.error) curves.push(plot('plot-error', 'Mean distance of the robot from the reference over time, millimetres', 'mm', [
      { name: 'error', stroke: '--accent', values: danced(column(data.error, 0, 1)) }]));
    curves.splice(0, curves.length, ...curves.filter(Boolean));
    show(state.picture);
  }
  data.joints.forEach((name, i) => $('joint').add(new Option(name, i)));
  $('joint').value = data.liveliest ?? 0;
  $('joint').addEventListener('change', plotAll);
  let width = 0;
  new ResizeObserver(([entry]) => {
    if (Math.abs(entry.contentRect.width - width) > 1) { width = entry.contentRect.width; plotAll(); }
  }).observe($('plot-angle'));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', plotAll);

  view.measure(); plotAll(); requestAnimationFrame(loop);
  if (matchMedia('(prefers-reduced-motion: reduce)').matches) go(0);
  else start().catch(() => go(0));
  node.dataset.ready = 'yes';
  window.robojackson = { state, video, view, go, step, data, curves };
})();
