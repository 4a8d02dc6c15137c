// The phantom at rest with what was found where. Millimetres.

const scene = JSON.parse(document.getElementById('scene-data').textContent);
let camera = 'above';
const cameras = {
  above: {eye: {x: -0.66, y: -1.8, z: 1.2}, center: {x: 0, y: 0, z: -0.06}, up: {x: 0, y: 0, z: 1}},
  side: {eye: {x: 0, y: -2.1, z: 0.15}, up: {x: 0, y: 0, z: 1}},
  below: {eye: {x: -0.66, y: -1.8, z: -1.2}, center: {x: 0, y: 0, z: 0}, up: {x: 0, y: 0, z: 1}},
};

// A disc that stands 0.4 mm off the surface.
function disc(shape) {
  const corners = 48, axes = ['x', 'y', 'z'], out = {x: [], y: [], z: []};
  axes.forEach((a, c) => {
    const centre = shape.centre_mm[c] + 0.4 * shape.normal[c];
    out[a].push(centre);
    for (let i = 0; i <= corners; i++) {
      const angle = 2 * Math.PI * i / corners;
      out[a].push(centre + shape.radius_mm * (Math.cos(angle) * shape.span[0][c] + Math.sin(angle) * shape.span[1][c]));
    }
  });
  const fan = [...Array(corners).keys()];
  return Object.assign(out, {i: fan.map(() => 0), j: fan.map(i => i + 1), k: fan.map(i => i + 2)});
}

// A ball of meridians and parallels.
function ball({centre_mm, radius_mm}) {
  const around = 28, up = 14, out = {x: [], y: [], z: [], i: [], j: [], k: []};
  for (let p = 0; p <= up; p++) {
    for (let m = 0; m < around; m++) {
      const polar = Math.PI * p / up, angle = 2 * Math.PI * m / around;
      out.x.push(centre_mm[0] + radius_mm * Math.sin(polar) * Math.cos(angle));
      out.y.push(centre_mm[1] + radius_mm * Math.sin(polar) * Math.sin(angle));
      out.z.push(centre_mm[2] + radius_mm * Math.cos(polar));
      if (p === up) continue;
      const a = p * around + m, b = p * around + (m + 1) % around;
      out.i.push(a, b);
      out.j.push(a + around, a + around);
      out.k.push(b, b + around);
    }
  }
  return out;
}

function drawPlace() {
  const part = name => ({i: scene.triangles[name][0], j: scene.triangles[name][1], k: scene.triangles[name][2]});
  const plain = {type: 'mesh3d', ...scene.nodes_mm, flatshading: true, hoverinfo: 'skip', lighting: {ambient: 0.75, diffuse: 0.35, specular: 0.05}};
  const flat = {type: 'mesh3d', flatshading: true, lighting: {ambient: 1, diffuse: 0, specular: 0}, hoverinfo: 'text'};
  const pokes = tip => (tip.numbers.length === 1 ? 'poke ' : 'pokes ') + tip.numbers.join(', ');
  const traces = [
    {...plain, ...part('fixed'), color: colour('fixed'), opacity: 0.6},
    {...plain, ...part('search'), color: colour('search'), opacity: 0.3},
    {...plain, ...part('free'), color: colour('middle'), opacity: 0.18},
    ...scene.tips.map(tip => ({...flat, ...disc(tip.disc), color: colour(tip.shows ? 'model' : 'ink'), opacity: tip.shows ? 0.75 : 0.35,
      hovertext: pokes(tip) + (tip.shows ? ': shows the mismatch' : '')})),
    ...scene.discs.map(d => ({...flat, ...disc(d.disc), color: colour('found'), hovertext: d.text})),
    ...scene.restraint.map(d => ({...flat, ...disc(d.disc), color: colour('most'), hovertext: d.text})),
    ...scene.balls.map(b => ({...flat, ...ball(b), flatshading: false, lighting: {ambient: 0.7, diffuse: 0.5}, color: colour('found'), opacity: 0.9, hovertext: b.text})),
  ];
  if (scene.region) traces.push({...flat, ...ball(scene.region), color: colour('model'), opacity: 0.18, hovertext: scene.region.text});
  const label = (at, text, ax, ay) => ({x: at[0], y: at[1], z: at[2], text, ax, ay, arrowhead: 0, arrowwidth: 1, arrowcolor: colour('ink'),
    bgcolor: colour('paper'), bordercolor: colour('rule'), borderpad: 2, opacity: 0.92, font: {size: 11}});
  const annotations = [
    ...scene.balls.map(b => label(b.centre_mm, b.text, 90, 56)),
    ...scene.discs.map(d => label(d.disc.centre_mm, d.text, 40, 96)),
    ...scene.restraint.map(d => label(d.disc.centre_mm, d.text, 46, 34)),
    ...scene.tips.map(tip => label(tip.disc.centre_mm, tip.numbers.join(', '), 0, -22)),
  ];
  if (scene.region) annotations.push(label(scene.region.centre_mm, scene.region.text, -90, 76));
  if (scene.next) {
    const to = scene.next.disc.centre_mm, from = to.map((v, i) => v - scene.arrow_mm * scene.next.direction[i]);
    const along = i => [from[i], to[i]];
    traces.push({...flat, ...disc(scene.next.disc), color: colour('extended'), opacity: 0.8, hovertext: 'next poke'});
    traces.push({type: 'scatter3d', mode: 'lines', x: along(0), y: along(1), z: along(2), line: {color: colour('extended'), width: 7}, hoverinfo: 'skip'});
    annotations.push(label(from, 'next poke', 40, -16));
  }
  const face = title => ({title: {text: title}, color: colour('quiet'), gridcolor: colour('rule'), showbackground: false, zeroline: false, nticks: 6});
  const layout = Object.assign(baseLayout(), {
    margin: {l: 0, r: 0, t: 0, b: 0},
    scene: {aspectmode: 'data', camera: cameras[camera], uirevision: camera, annotations, xaxis: face('x, mm'), yaxis: face('y, mm'), zaxis: face('z, mm')},
  });
  const key = (name, text, opacity = 1) => ' <span class="key"><span class="swatch round" style="background:' + colour(name) + ';opacity:' + opacity + '"></span>' + text + '</span>';
  document.getElementById('phantom-legend').innerHTML = 'At rest.' + (scene.region ? '' : ' The misfit sits nowhere in particular.') + key('ink', 'poke', 0.35) + (scene.tips.some(t => t.shows) ? key('model', 'poke that shows the mismatch') : '') +
    (scene.region ? key('model', 'where the misfit sits') : '') + (scene.balls.length + scene.discs.length ? key('found', 'found') : '') + (scene.restraint.length ? key('most', 'restraint') : '') +
    (scene.next ? key('extended', 'next poke') : '') + key('fixed', 'fixed surface') + key('search', 'searched surface');
  return Plotly.react(document.getElementById('phantom'), traces, layout, config);
}

plots.push(drawPlace);
controls.push(() => document.getElementById('camera').addEventListener('change', event => {
  camera = event.target.value;
  drawPlace();
}));
