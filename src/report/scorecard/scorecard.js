// Reliability and power: bins of equal count.

const series = JSON.parse(document.getElementById('series-data').textContent);

function dots(bins, name, text) {
  return {type: 'scatter', mode: 'lines+markers', x: bins.map(b => b.mean), y: bins.map(b => b.right), line: {color: colour(name), width: 1.4},
    marker: {color: colour(name), size: 9}, hovertext: bins.map(b => b.count + ' draws'), hovertemplate: '%{hovertext}: %{y:.2f} ' + text + ' at %{x:.3g}<extra></extra>'};
}

function drawReliability() {
  const shares = {range: [-0.03, 1.03], nticks: 6, zeroline: false};
  const layout = Object.assign(baseLayout(), {height: 330, xaxis: axis('confidence', shares), yaxis: axis('share right', shares),
    shapes: [{type: 'line', x0: 0, y0: 0, x1: 1, y1: 1, line: {color: colour('quiet'), width: 1.2, dash: 'dash'}}]});
  return Plotly.react(document.getElementById('reliability'), [dots(series.reliability, 'measured', 'right')], layout, config);
}

function drawPower() {
  const layout = Object.assign(baseLayout(), {height: 330, showlegend: true, legend: {x: 0.98, y: 0.05, xanchor: 'right', yanchor: 'bottom'},
    xaxis: axis('strength', {type: 'log'}), yaxis: axis('share', {range: [-0.03, 1.03], nticks: 6, zeroline: false})});
  const traces = [{...dots(series.detected, 'measured', 'detected'), name: 'detected'}, {...dots(series.named, 'extended', 'named right'), name: 'named right'}];
  return Plotly.react(document.getElementById('power'), traces, layout, config);
}

plots.push(drawReliability, drawPower);
