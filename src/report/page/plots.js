// Forces and residuals in the plane. Millimetres, newtons, millinewtons, micrometres, seconds.

const series = JSON.parse(document.getElementById('series-data').textContent);

// One small plot a poke, all with the same axes.
function drawForce() {
  const node = document.getElementById('force'), wide = node.clientWidth > 900, columns = wide ? (series.pokes.length > 12 ? 6 : 4) : 3;
  const rows = Math.max(1, Math.ceil(series.pokes.length / columns));
  const layout = Object.assign(baseLayout(), {
    grid: {rows, columns, pattern: 'independent', xgap: 0.05, ygap: 0.22},
    height: 60 + 165 * rows, margin: {l: 48, r: 10, t: 24, b: 40}, annotations: [],
  });
  const traces = series.pokes.flatMap((poke, i) => {
    const n = i ? String(i + 1) : '', place = {xaxis: 'x' + n, yaxis: 'y' + n};
    const depth = poke.depth_mm !== null, across = depth ? poke.depth_mm : poke.t_s;
    const last = i + columns >= series.pokes.length, first = i % columns === 0, shared = depth && i;
    layout['xaxis' + n] = axis(last ? (depth ? 'depth, mm' : 'time, s') : '', {nticks: 6, matches: shared ? 'x' : undefined, showticklabels: last || !depth});
    layout['yaxis' + n] = axis(first ? 'force, N' : '', {nticks: 5, matches: i ? 'y' : undefined, showticklabels: first});
    layout.annotations.push({text: 'poke ' + poke.number, showarrow: false, xref: 'x' + n + ' domain', yref: 'y' + n + ' domain',
      x: 0.02, y: 1, xanchor: 'left', yanchor: 'bottom', font: {size: 12, color: colour('quiet')}});
    return [
      {type: 'scatter', mode: 'markers', ...place, x: across, y: poke.measured_n, marker: {size: 4, color: colour('measured'), opacity: 0.5},
        hovertemplate: '%{x}, %{y:.3f} N measured<extra></extra>'},
      {type: 'scatter', mode: 'lines', ...place, x: across, y: poke.model_n, line: {width: 1.6, color: colour('model')},
        hovertemplate: '%{x}, %{y:.3f} N model<extra></extra>'},
    ];
  });
  return Plotly.react(node, traces, layout, config);
}

function drawForceResidual() {
  const names = ['x', 'y', 'z'], layout = Object.assign(baseLayout(), {height: 390, margin: {l: 58, r: 10, t: 20, b: 40}, shapes: [], annotations: []});
  const time = series.pokes.flatMap(p => [...p.t_s, null]);
  const traces = names.map((name, c) => {
    const n = c ? String(c + 1) : '', top = 1 - c * 0.345, two = 2 * series.force_sd_mn[c];
    layout['yaxis' + n] = axis(name + ', mN', {domain: [top - 0.31, top], nticks: 5, zeroline: true});
    layout.shapes.push({type: 'rect', xref: 'paper', yref: 'y' + n, x0: 0, x1: 1, y0: -two, y1: two, fillcolor: colour('band'), line: {width: 0}, layer: 'below'});
    return {type: 'scatter', mode: 'lines', x: time, y: series.pokes.flatMap(p => [...p.residual_mn[c], null]), xaxis: 'x', yaxis: 'y' + n,
      connectgaps: false, line: {width: 0.9, color: colour('measured')}, hovertemplate: '%{x:.2f} s, ' + name + ' %{y:.1f} mN<extra></extra>'};
  });
  layout.xaxis = axis('time, s', {anchor: 'y3', zeroline: false});
  for (const poke of series.pokes) {
    if (!poke.t_s.length) continue;
    const start = poke.t_s[0], end = poke.t_s[poke.t_s.length - 1];
    layout.annotations.push({text: String(poke.number), showarrow: false, x: (start + end) / 2, xref: 'x', y: 1, yref: 'paper', yanchor: 'bottom', font: {color: colour('quiet')}});
  }
  return Plotly.react(document.getElementById('force-residual'), traces, layout, config);
}

// Spread of a point within its poke's column: a low-discrepancy sequence, the same on every drawing.
function jitter(i) {
  return 0.56 * ((i * 0.6180339887) % 1 - 0.5);
}

function pokeAxis() {
  const places = series.pokes.map((_, i) => i);
  return axis('poke', {tickvals: places, ticktext: series.pokes.map(p => String(p.number)), zeroline: false, showgrid: false, range: [-0.6, places.length - 0.4]});
}

function across(y) {
  return {type: 'line', xref: 'paper', x0: 0, x1: 1, yref: 'y', y0: y, y1: y, line: {color: colour('ink'), width: 1.2, dash: 'dash'}};
}

function drawMarkerResidual() {
  const rms = values => Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / Math.max(1, values.length));
  const traces = series.pokes.map((p, i) => ({
    type: 'scatter', mode: 'markers', x: p.marker_residual_um.map((_, k) => i + jitter(k)), y: p.marker_residual_um,
    marker: {size: 4, color: colour('measured'), opacity: 0.45}, hovertext: p.marker.map(m => 'marker ' + m), hovertemplate: '%{hovertext}: %{y:.0f} µm<extra></extra>',
  }));
  traces.push({type: 'scatter', mode: 'markers', x: series.pokes.map((_, i) => i), y: series.pokes.map(p => rms(p.marker_residual_um)),
    marker: {symbol: 'diamond', size: 11, color: colour('model'), line: {color: colour('paper'), width: 1.5}}, hovertemplate: 'rms %{y:.0f} µm<extra></extra>'});
  const layout = Object.assign(baseLayout(), {xaxis: pokeAxis(), yaxis: axis('residual, µm', {rangemode: 'tozero'}), shapes: [across(series.marker_length_sd_um)]});
  return Plotly.react(document.getElementById('marker-residual'), traces, layout, config);
}

function drawChi2() {
  const values = series.pokes.map(p => p.chi2_per_value);
  const bars = {type: 'bar', x: values.map((_, i) => i), y: values, marker: {color: colour('measured')}, width: 0.6,
    text: values.length > 12 ? [] : values.map(v => v === null ? 'n/a' : v.toPrecision(3)), textposition: 'outside', cliponaxis: false, hovertemplate: '%{y:.3f}<extra></extra>'};
  const layout = Object.assign(baseLayout(), {xaxis: pokeAxis(), yaxis: axis('χ² per value', {rangemode: 'tozero', range: [0, 1.15 * Math.max(1.2, ...values)]}), shapes: [across(1)]});
  return Plotly.react(document.getElementById('chi2'), [bars], layout, config);
}

plots.push(drawForce, drawForceResidual, drawMarkerResidual, drawChi2);
