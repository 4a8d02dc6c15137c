// Which colours: those of the room (the system's choice), unless the person picks the other; paper is light.

const root = document.documentElement;
const plots = [];  // functions that draw one plot each, called again when colours or sizes change
const controls = [];  // functions that put life into buttons and choices, called once

function colour(name) {
  return getComputedStyle(root).getPropertyValue('--' + name).trim();
}

function setTheme(theme) {
  root.dataset.theme = theme;
  document.getElementById('theme').textContent = theme === 'dark' ? 'Light' : 'Dark';
}

function drawAll() {
  return Promise.all(plots.map(draw => draw()));
}

// Layout that all plots share.
function baseLayout() {
  return {
    paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', showlegend: false, autosize: true,
    font: {family: getComputedStyle(document.body).fontFamily, size: 12, color: colour('ink')},
    hoverlabel: {font: {family: getComputedStyle(document.body).fontFamily}},
    modebar: {bgcolor: 'rgba(0,0,0,0)', color: colour('rule'), activecolor: colour('quiet')},
    margin: {l: 54, r: 10, t: 8, b: 38}, uirevision: 'kept',
  };
}

function axis(title, more) {
  return Object.assign({
    title: {text: title, standoff: 6}, gridcolor: colour('rule'), zerolinecolor: colour('rule'), linecolor: colour('quiet'),
    ticks: 'outside', ticklen: 3, tickcolor: colour('quiet'), automargin: true,
  }, more);
}

const config = {displaylogo: false, responsive: true, modeBarButtonsToRemove: ['lasso2d', 'select2d', 'autoScale2d', 'zoomIn2d', 'zoomOut2d', 'tableRotation', 'resetCameraLastSave3d']};
