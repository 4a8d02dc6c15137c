// Plots of a sheet: lines and dots with their deviations.

// Dots and lines take their colours from different ends, so that a line is seen on its own dots.
const dots = ['measured', 'extended', 'good', 'quiet', 'bad', 'ink'], lines = ['bad', 'ink', 'extended', 'measured', 'quiet', 'good'];
const MANY = 120;

for (const [number, plot] of JSON.parse(document.getElementById('series-data').textContent).entries()) {
  plots.push(() => {
    const before = (trace, k) => plot.traces.slice(0, k).filter(other => other.line === trace.line).length;
    const shade = (trace, k) => colour((trace.line ? lines : dots)[before(trace, k) % dots.length]);
    const traces = plot.traces.map((trace, k) => ({
      type: 'scatter', name: trace.name, x: trace.x, y: trace.y, mode: trace.line ? 'lines' : 'markers',
      line: {color: shade(trace, k), width: 2}, marker: {color: shade(trace, k), size: trace.x.length > MANY ? 4 : 7},
      error_y: trace.sd ? {type: 'data', array: trace.sd, width: 3, thickness: 1} : undefined,
    }));
    const across = plot.decades === 'none' ? {} : {type: 'log', dtick: 1, exponentformat: 'power'};
    const up = plot.decades === 'both' ? {type: 'log'} : {};
    const layout = Object.assign(baseLayout(), {height: 330 + 14 * Math.max(0, traces.length - 4), showlegend: traces.length > 1,
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom'}, margin: {l: 64, r: 10, t: 26, b: 38}, xaxis: axis(plot.across, across),
      yaxis: axis(plot.up, up)});
    return Plotly.react(document.getElementById('plot-' + number), traces, layout, config);
  });
}
