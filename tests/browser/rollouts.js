/* Rollouts of a live dance in node: node rollouts.js ASSETS DANCE.JS DATA.JSON STEPS PUSHED_AT, pushes (x, y) as JSON on standard input. */
'use strict';
const fs = require('fs');
const [assets, script, data, steps, pushedAt] = process.argv.slice(2);
globalThis.MUJOCO = new Function(`${fs.readFileSync(`${assets}/mujoco.min.js`, 'utf8')}; return MUJOCO`)();
const Dance = require(script);
(async () => {
  const dance = JSON.parse(fs.readFileSync(data, 'utf8')), pushes = JSON.parse(fs.readFileSync(0, 'utf8'));
  const dancer = new Dance.Dancer(await Dance.load(fs.readFileSync(`${assets}/mujoco.wasm.gz`).toString('base64')), dance);
  const found = dance.records.map((record, i) => {
    dancer.start(record.step, { qpos: Float64Array.from(record.qpos), qvel: Float64Array.from(record.qvel) });
    let error = 0;
    for (let k = 0; k < Number(steps); k++) {
      if (k === Number(pushedAt)) dancer.push(...pushes[i]);
      if (!dancer.advance()) break;
      error += dancer.error;
    }
    return [dancer.danced, error / Math.max(1, dancer.danced)];
  });
  console.log(JSON.stringify({ found, deviations: dance.records.map((record) => dancer.deviation(record)) }));
})();
