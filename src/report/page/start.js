// Draw, and draw again when colours or paper change. `data-ready` on the document says that all plots stand.

const room = matchMedia('(prefers-color-scheme: dark)');

setTheme(room.matches ? 'dark' : 'light');
controls.forEach(enliven => enliven());
drawAll().then(() => { root.dataset.ready = 'yes'; });

room.addEventListener('change', () => {
  setTheme(room.matches ? 'dark' : 'light');
  drawAll();
});
document.getElementById('theme').addEventListener('click', () => {
  setTheme(root.dataset.theme === 'dark' ? 'light' : 'dark');
  drawAll();
});

// Paper: light colours, the width of a sheet. What a 3-D canvas shows is taken from the last frame of the
// screen, and no frame comes before the sheet is taken; so a copy of the view, drawn at once, stands in for it.
let before = null;
function copyForPaper(plot) {
  const gl = plot._fullLayout?.scene?._scene?.glplot;
  if (!gl?.redraw || !gl.canvas) return;
  gl.redraw();
  const copy = document.createElement('canvas');
  copy.width = gl.canvas.width;
  copy.height = gl.canvas.height;
  copy.className = 'paper';
  copy.getContext('2d').drawImage(gl.canvas, 0, 0);
  gl.canvas.after(copy);
}
addEventListener('beforeprint', () => {
  before = root.dataset.theme;
  setTheme('light');
  drawAll();
  for (const plot of document.querySelectorAll('.plot')) {
    Plotly.relayout(plot, plot.id === 'phantom' ? {width: 690, height: 350} : {width: 690});
    copyForPaper(plot);
  }
});
addEventListener('afterprint', () => {
  document.querySelectorAll('canvas.paper').forEach(copy => copy.remove());
  setTheme(before);
  for (const plot of document.querySelectorAll('.plot')) Plotly.relayout(plot, {width: null, height: null, autosize: true});
  drawAll();
});
