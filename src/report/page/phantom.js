// The phantom in three dimensions at the deepest instant of one poke. Millimetres; displacements arrive in µm.

const scene = JSON.parse(document.getElementById('scene-data').textContent);
const chosen = {poke: 0, exaggeration: scene.displacement_factor, magnification: scene.residual_factor, camera: 'above'};
const cameras = {
  above: {eye: {x: -0.66, y: -1.8, z: 1.2}, center: {x: 0, y: 0, z: -0.06}, up: {x: 0, y: 0, z: 1}},
  side: {eye: {x: 0, y: -2.1, z: 0.15}, up: {x: 0, y: 0, z: 1}},
  below: {eye: {x: -0.66, y: -1.8, z: -1.2}, center: {x: 0, y: 0, z: 0}, up: {x: 0, y: 0, z: 1}},
};

// Columns of rest positions (mm) moved by `factor` times a displacement (µm).
function moved(rest, displacement, factor) {
  const along = a => rest[a].map((v, i) => v + factor * displacement[a][i] * 1e-3);
  return {x: along('x'), y: along('y'), z: along('z')};
}

// A disc that stands 0.4 mm off the surface and moves with the node under it.
function disc(shape, displacement, factor) {
  const corners = 48, axes = ['x', 'y', 'z'], out = {x: [], y: [], z: []};
  axes.forEach((a, c) => {
    const centre = shape.centre_mm[c] + 0.4 * shape.normal[c] + factor * displacement[a][shape.node] * 1e-3;
    out[a].push(centre);
    for (let i = 0; i <= corners; i++) {
      const angle = 2 * Math.PI * i / corners;
      out[a].push(centre + shape.radius_mm * (Math.cos(angle) * shape.span[0][c] + Math.sin(angle) * shape.span[1][c]));
    }
  });
  const fan = [...Array(corners).keys()];
  return Object.assign(out, {i: fan.map(() => 0), j: fan.map(i => i + 1), k: fan.map(i => i + 2)});
}

function surfaces(poke, at) {
  const u = poke.displacement_um;
  const size = u.x.map((x, i) => Math.hypot(x, u.y[i], u.z[i]) * 1e-3);
  const part = name => ({i: scene.triangles[name][0], j: scene.triangles[name][1], k: scene.triangles[name][2]});
  const plain = {type: 'mesh3d', ...at, flatshading: true, hoverinfo: 'skip', lighting: {ambient: 0.75, diffuse: 0.35, specular: 0.05}};
  return [
    {...plain, ...part('fixed'), color: colour('fixed')},
    {...plain, ...part('search'), color: colour('search'), opacity: 0.4},
    {...plain, ...part('free'), opacity: 0.45, intensity: size, cmin: 0, cmax: size.reduce((a, b) => Math.max(a, b), 1e-6),
      colorscale: [[0, colour('least')], [0.5, colour('middle')], [1, colour('most')]],
      hoverinfo: 'text', hovertext: size.map(s => 'displacement ' + s.toFixed(3) + ' mm'),
      colorbar: {title: {text: 'displacement of the model, mm', side: 'right'}, thickness: 12, len: 0.8, x: 1, outlinewidth: 0}},
  ];
}

function discs(poke) {
  const flat = {type: 'mesh3d', flatshading: true, lighting: {ambient: 1, diffuse: 0, specular: 0}, hoverinfo: 'text'};
  const traces = scene.patches.map(patch => ({
    ...flat, ...disc(patch.disc, poke.displacement_um, chosen.exaggeration),
    color: colour(patch.glued ? 'glue' : 'patch'), hovertext: 'patch ' + patch.label + ': ' + patch.text,
  }));
  traces.push({...flat, ...disc(poke.tip, poke.displacement_um, chosen.exaggeration), color: colour('ink'), opacity: 0.5,
    hovertext: 'tip, poke ' + poke.number});
  return traces;
}

// Names of the patches, drawn above everything so that the phantom does not hide them.
function labels(poke) {
  const u = poke.displacement_um, factor = chosen.exaggeration * 1e-3;
  return scene.patches.map(({disc: d, label, text}) => ({
    x: d.centre_mm[0] + factor * u.x[d.node], y: d.centre_mm[1] + factor * u.y[d.node], z: d.centre_mm[2] + factor * u.z[d.node],
    text: label + ': ' + text, ax: 46, ay: 34, arrowhead: 0, arrowwidth: 1, arrowcolor: colour('ink'),
    bgcolor: colour('paper'), bordercolor: colour('rule'), borderpad: 2, opacity: 0.92, font: {size: 11},
  }));
}

function residuals(poke) {
  const feet = moved(poke.marker_rest_mm, poke.marker_model_um, chosen.exaggeration);
  const heads = moved(feet, poke.marker_residual_um, chosen.magnification);
  const r = poke.marker_residual_um, lines = {};
  for (const a of ['x', 'y', 'z']) lines[a] = feet[a].flatMap((v, i) => [v, heads[a][i], null]);
  const [sx, sy, sz] = scene.marker_sd_um;
  const text = poke.marker.map((m, i) => 'marker ' + m + ': residual ' + Math.hypot(r.x[i], r.y[i], r.z[i]).toFixed(0) + ' µm, rms ' +
    (Math.hypot(r.x[i] / sx, r.y[i] / sy, r.z[i] / sz) / Math.sqrt(3)).toFixed(1) + ' sd of the noise');
  return [
    {type: 'scatter3d', mode: 'markers', ...feet, marker: {size: 2.2, color: colour('ink')}, hoverinfo: 'text', hovertext: text},
    {type: 'scatter3d', mode: 'lines', ...lines, line: {color: colour('model'), width: 4}, hoverinfo: 'skip'},
  ];
}

function drawPhantom() {
  const poke = scene.pokes[chosen.poke], node = document.getElementById('phantom');
  if (!poke) return Promise.resolve();
  const at = moved(scene.nodes_mm, poke.displacement_um, chosen.exaggeration);
  const traces = [...surfaces(poke, at), ...discs(poke), ...residuals(poke)];
  const face = title => ({title: {text: title}, color: colour('quiet'), gridcolor: colour('rule'), showbackground: false, zeroline: false, nticks: 6});
  const layout = Object.assign(baseLayout(), {
    margin: {l: 0, r: 0, t: 0, b: 0},
    scene: {aspectmode: 'data', domain: {x: [0, 0.97], y: [0, 1]}, camera: cameras[chosen.camera], uirevision: chosen.camera, annotations: labels(poke),
      xaxis: face('x, mm'), yaxis: face('y, mm'), zaxis: face('z, mm')},
  });
  legend();
  return Plotly.react(node, traces, layout, config);
}

function legend() {
  const key = (name, kind, text) => ' <span class="key"><span class="swatch ' + kind + '" style="background:' + colour(name) + '"></span>' + text + '</span>';
  const ten = 10 / chosen.magnification, length = ten < 1 ? (ten * 1e3).toPrecision(2) * 1 + ' µm' : ten.toPrecision(2) * 1 + ' mm';
  const poke = scene.pokes[chosen.poke];
  document.getElementById('phantom-legend').innerHTML =
    'Poke ' + poke.number + ' at its deepest, ' + poke.deepest_s.toFixed(2) + ' s. Displacements drawn × ' + chosen.exaggeration + ', residuals × ' + chosen.magnification + '.' +
    key('model', 'line', 'marker residual (10 mm drawn is ' + length + ')') + key('ink', 'round', 'marker, tip') +
    key('patch', 'round', 'spring patch') + key('glue', 'round', 'glued patch') +
    key('fixed', '', 'fixed surface') + key('search', '', 'searched surface');
}

function options(select, values, current, text) {
  select.replaceChildren(...values.map(v => new Option(text(v), v, false, v === current)));
}

function phantomControls() {
  const control = id => document.getElementById(id), poke = control('poke');
  options(poke, scene.pokes.map((_, i) => i), 0, i => String(scene.pokes[i].number));
  const factors = own => [...new Set([1, 2, 5, 10, own])].sort((a, b) => a - b);
  options(control('exaggeration'), factors(scene.displacement_factor), chosen.exaggeration, v => '× ' + v);
  const own = scene.residual_factor;
  options(control('magnification'), [...new Set([1, own / 5, own, own * 5])].sort((a, b) => a - b), own, v => '× ' + v);
  const choose = (id, key, read) => control(id).addEventListener('change', event => {
    chosen[key] = read(event.target.value);
    drawPhantom();
  });
  choose('poke', 'poke', Number);
  choose('exaggeration', 'exaggeration', Number);
  choose('magnification', 'magnification', Number);
  choose('camera', 'camera', String);
  const step = by => () => {
    chosen.poke = (chosen.poke + by + scene.pokes.length) % scene.pokes.length;
    poke.value = chosen.poke;
    drawPhantom();
  };
  control('previous').addEventListener('click', step(-1));
  control('next').addEventListener('click', step(1));
}

plots.push(drawPhantom);
controls.push(phantomControls);
