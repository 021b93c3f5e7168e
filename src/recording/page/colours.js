// Colours by number, told apart also by those who do not see red and green.
function ramp(stops) {
  const colours = stops.map((stop) => new THREE.Color(stop));
  const at = (t) => {
    const place = Math.min(Math.max(t, 0), 1) * (colours.length - 1);
    const i = Math.min(Math.floor(place), colours.length - 2);
    return colours[i].clone().lerp(colours[i + 1], place - i);
  };
  const table = new Float32Array(3 * 256);
  for (let i = 0; i < 256; ++i) at(i / 255).toArray(table, 3 * i);
  return {
    css: `linear-gradient(90deg, ${stops.join(", ")})`,
    write: (t, out, k) => {
      const i = 3 * Math.round(255 * Math.min(Math.max(t, 0), 1));
      out[k] = table[i];
      out[k + 1] = table[i + 1];
      out[k + 2] = table[i + 2];
    },
  };
}

const inflationRamp = ramp(["#3f8efc", "#8f6bd9", "#f0731c"]);
const clearanceRamp = ramp(["#b2182b", "#ef8a62", "#f3e9df", "#67a9cf", "#2166ac"]);
const kRefitted = "#12b76a";
const bodyColours = ["#7f9cbd", "#c9a97c", "#8fb08c", "#b08fb3", "#a3a3a3", "#c98f85"];

function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
