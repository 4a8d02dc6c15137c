// Plots of a sheet: lines and dots with their deviations.

const shades = ['measured', 'extended', 'ink', 'bad', 'good', 'quiet'];

for (const [number, plot] of JSON.parse(document.getElementById('series-data').textContent).entries()) {
  plots.push(() => {
    const traces = plot.traces.map((trace, k) => ({
      type: 'scatter', name: trace.name, x: trace.x, y: trace.y, mode: trace.line ? 'lines' : 'markers',
      line: {color: colour(shades[k % shades.length]), width: 1.4}, marker: {color: colour(shades[k % shades.length]), size: 7},
      error_y: trace.sd ? {type: 'data', array: trace.sd, width: 3, thickness: 1} : undefined,
    }));
    const scale = plot.log ? {type: 'log'} : {};
    const layout = Object.assign(baseLayout(), {height: 330, showlegend: traces.length > 1, legend: {orientation: 'h', y: 1.12},
      margin: {l: 64, r: 10, t: 26, b: 38}, xaxis: axis(plot.across, scale), yaxis: axis(plot.up, scale)});
    return Plotly.react(document.getElementById('plot-' + number), traces, layout, config);
  });
}
