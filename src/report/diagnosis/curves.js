// Before and after, on pokes that the fit did not see. Seconds, newtons, millinewtons.

const series = JSON.parse(document.getElementById('series-data').textContent);
const models = series.extended ? [['baseline', 'model', 'dash'], ['extended', 'extended', 'solid']] : [['baseline', 'model', 'solid']];
const said = {baseline: 'nothing left out', extended: 'with what is blamed'};

function curveLegend() {
  const key = (name, kind, text) => ' <span class="key"><span class="swatch ' + kind + '" style="background:' + colour(name) + '"></span>' + text + '</span>';
  document.getElementById('curve-legend').innerHTML = key('measured', 'round', 'measured') + models.map(([m, c]) => key(c, 'line', 'predicted, ' + said[m])).join('');
}

// One small plot a poke, all with the same force axis.
function drawForce() {
  const node = document.getElementById('force'), columns = Math.min(3, Math.max(1, series.pokes.length));
  const rows = Math.max(1, Math.ceil(series.pokes.length / columns));
  const layout = Object.assign(baseLayout(), {
    grid: {rows, columns, pattern: 'independent', xgap: 0.08, ygap: 0.28},
    height: Math.max(320, 72 + 145 * rows), margin: {l: 48, r: 8, t: 44, b: 36}, annotations: [],
  });
  const traces = series.pokes.flatMap((poke, i) => {
    const n = i ? String(i + 1) : '', place = {xaxis: 'x' + n, yaxis: 'y' + n};
    const last = i + columns >= series.pokes.length, first = i % columns === 0;
    layout['xaxis' + n] = axis(last ? 'time, s' : '', {nticks: 6});
    layout['yaxis' + n] = axis(first ? 'force, N' : '', {nticks: 5, matches: i ? 'y' : undefined, showticklabels: first});
    layout.annotations.push({text: (poke.shows ? '<b>poke ' + poke.number + '</b>' : 'poke ' + poke.number), showarrow: false, xref: 'x' + n + ' domain', yref: 'y' + n + ' domain',
      x: 0.02, y: 1, xanchor: 'left', yanchor: 'bottom', font: {size: 12, color: colour(poke.shows ? 'ink' : 'quiet')}});
    return [
      {type: 'scatter', mode: 'markers', ...place, x: poke.t_s, y: poke.measured_n, marker: {size: 3, color: colour('measured'), opacity: 0.35},
        hovertemplate: '%{x} s, %{y:.3f} N measured<extra></extra>'},
      ...models.map(([m, c, dash]) => ({type: 'scatter', mode: 'lines', ...place, x: poke.t_s, y: poke[m + '_n'], line: {width: 1.8, color: colour(c), dash},
        hovertemplate: '%{x} s, %{y:.3f} N ' + said[m] + '<extra></extra>'})),
    ];
  });
  curveLegend();
  return Plotly.react(node, traces, layout, config);
}

// Starts of the pokes laid end to end, with a gap.
function starts(times) {
  const lengths = series.pokes.map(p => Math.max(1, ...times(p)));
  const gap = 0.08 * Math.max(1, ...lengths);
  let at = 0;
  return lengths.map(length => { const start = at; at += length + gap; return {start, middle: start + length / 2}; });
}

function endToEnd(id, times, values, layoutMore, hover) {
  const places = starts(times);
  const traces = models.map(([m, c]) => ({
    type: 'scatter', mode: 'lines', connectgaps: false, line: {width: 1.2, color: colour(c)}, opacity: 0.9,
    x: series.pokes.flatMap((p, i) => [...times(p).map(t => t + places[i].start), null]), y: series.pokes.flatMap(p => [...values(p, m), null]),
    hovertemplate: '%{y:.3g} ' + hover + ', ' + said[m] + '<extra></extra>',
  }));
  const layout = Object.assign(baseLayout(), {height: 290, margin: {l: 54, r: 10, t: 46, b: 14}}, layoutMore);
  layout.xaxis = axis('', {showticklabels: false, ticks: '', zeroline: false, showgrid: false});
  layout.annotations = series.pokes.map((p, i) => ({text: p.shows ? '<b>' + p.number + '</b>' : String(p.number), showarrow: false, x: places[i].middle, xref: 'x', y: 1, yref: 'paper',
    yanchor: 'bottom', font: {color: colour(p.shows ? 'ink' : 'quiet')}}));
  return Plotly.react(document.getElementById(id), traces, layout, config);
}

function drawForceLeft() {
  const two = 2 * series.force_sd_mn;
  const band = {type: 'rect', xref: 'paper', yref: 'y', x0: 0, x1: 1, y0: -two, y1: two, fillcolor: colour('band'), line: {width: 0}, layer: 'below'};
  return endToEnd('force-left', p => p.t_s, (p, m) => p[m + '_left_mn'], {shapes: [band], yaxis: axis('mN', {zeroline: true})}, 'mN');
}

function drawMarkerLeft() {
  const line = {type: 'line', xref: 'paper', x0: 0, x1: 1, yref: 'y', y0: 1, y1: 1, line: {color: colour('ink'), width: 1.2, dash: 'dash'}};
  return endToEnd('marker-left', p => p.marker_t_s, (p, m) => p['marker_' + m], {shapes: [line], yaxis: axis('over noise', {rangemode: 'tozero'})}, '× noise');
}

plots.push(drawForce, drawForceLeft, drawMarkerLeft);
