// Saves the view as a PNG file, and the run as a video, or as a PNG file for each frame if the
// browser cannot record videos.
const pictureCanvas = document.createElement("canvas");

// Fills the place of an element as the style sheet does: with its gradient or its colour.
function fillAs(pen, box, {backgroundImage, backgroundColor, borderRadius}) {
  const {left, top, width, height} = box, stops = backgroundImage.match(/rgba?\([^)]*\)/g) || [];
  const end = backgroundImage.includes("90deg") ? [left + width, top] : [left, top + height];
  const gradient = pen.createLinearGradient(left, top, ...end);
  stops.forEach((stop, i) => gradient.addColorStop(i / (stops.length - 1), stop));
  pen.fillStyle = stops.length ? gradient : backgroundColor;
  pen.beginPath();
  if (pen.roundRect) pen.roundRect(left, top, width, height, parseFloat(borderRadius));
  else pen.rect(left, top, width, height);
  pen.fill();
}

// Draws what stands over the scene where the page shows it: the distance, the legends, the texts.
function drawOverlays(pen) {
  const stage = element("stage"), origin = canvas.getBoundingClientRect();
  const placed = ({left, top, width, height}) =>
    ({left: left - origin.left, top: top - origin.top, width, height});
  for (const filled of stage.querySelectorAll("#tag, .ramp, .dot"))
    fillAs(pen, placed(filled.getBoundingClientRect()), getComputedStyle(filled));
  const texts = document.createTreeWalker(stage, NodeFilter.SHOW_TEXT), range = document.createRange();
  pen.textBaseline = "middle";
  while (texts.nextNode()) {
    range.selectNodeContents(texts.currentNode);
    const box = placed(range.getBoundingClientRect());
    if (box.width === 0) continue;  // hidden
    const {fontSize, fontFamily, color} = getComputedStyle(texts.currentNode.parentElement);
    pen.font = `${fontSize} ${fontFamily}`;
    pen.fillStyle = color;
    pen.fillText(texts.currentNode.data, box.left, box.top + box.height / 2);
  }
  drawScaleBar(pen, placed(element("scale").getBoundingClientRect()));
}

function drawScaleBar(pen, {left, top, width, height}) {
  pen.strokeStyle = css("--ink");
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(left, top + height - 8);
  pen.lineTo(left, top + height - 1);
  pen.lineTo(left + width, top + height - 1);
  pen.lineTo(left + width, top + height - 8);
  pen.stroke();
}

// Writes at the top what the panel says beside the scene: title, frame and distance, and the
// colours of the recorded arrows and segments.
function drawTitle(pen, width) {
  const distance = columns.distance[frameShown], keys = labelViews.filter(({wanted, drawn}) => wanted && drawn);
  const said = [document.title, `frame ${frameShown + 1} of ${run.frames.length}`];
  if (distance !== undefined) said.push(`distance ${shown.length(distance)}`);
  pen.font = "12px system-ui, sans-serif";
  pen.fillStyle = css("--ink");
  pen.fillText(said.join(", "), 12, 18, width - 24);
  keys.forEach(({colour, label}, i) => {
    pen.fillStyle = colour;
    pen.fillRect(12, 31 + 18 * i, 10, 10);
    pen.fillStyle = css("--ink");
    pen.fillText(label, 28, 36 + 18 * i, width - 40);
  });
}

// Draws the scene and what stands over it on a canvas, and returns it.
function composeView() {
  render();
  const {width, height} = canvas, ratio = width / canvas.getBoundingClientRect().width;
  const {backgroundImage} = getComputedStyle(element("stage"));
  if (!renderer || renderer.getContext().isContextLost()) throw new Error("this browser shows no WebGL");
  if (width < 2 || height < 2) throw new Error("the page has no room for the scene; make its window larger");
  // Video encoders need even sizes.
  pictureCanvas.width = width - width % 2;
  pictureCanvas.height = height - height % 2;
  const pen = pictureCanvas.getContext("2d");
  fillAs(pen, {left: 0, top: 0, width, height}, {backgroundImage, borderRadius: "0"});
  pen.drawImage(canvas, 0, 0);
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  drawOverlays(pen);
  drawTitle(pen, width / ratio);
  return pictureCanvas;
}

const pictureBlob = () => new Promise((resolve, reject) => composeView().toBlob((blob) =>
  (blob ? resolve(blob) : reject(new Error("the browser has no memory for it"))), "image/png"));
const pauseFor = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

function saveAs(blob, ending) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = document.title.replace(/[^\p{L}\p{N}]+/gu, "-").toLowerCase() + ending;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

function frameName() {
  return "-" + String(frameShown + 1).padStart(String(run.frames.length).length, "0");
}

function sayExport(text, failed = false) {
  element("export-status").textContent = text;
  element("export-status").classList.toggle("failed", failed);
}

async function savePicture() {
  try {
    saveAs(await pictureBlob(), frameName() + ".png");
    if (!exporting) sayExport("");
  } catch ({message}) {
    sayExport(`The picture is not saved: ${message}.`, true);
  }
}

const videoType = ["video/webm;codecs=vp9", "video/webm", "video/mp4"].find((type) =>
  window.MediaRecorder && MediaRecorder.isTypeSupported(type));

// Shows all frames and calls work(frame) for each, while goesOn() returns true.
async function eachFrame(work, goesOn) {
  const before = frameShown;
  pause();
  try {
    for (let frame = 0; frame < run.frames.length && goesOn(); ++frame) {
      show(frame);
      await work(frame);
    }
  } finally {
    show(before);
  }
}

// Records all frames as a video, at the speed of the player.
async function filmFrames(goesOn) {
  const film = new MediaRecorder(composeView().captureStream(), {mimeType: videoType,
    videoBitsPerSecond: 8e6});
  const parts = [], done = new Promise((resolve) => { film.onstop = resolve; });
  film.ondataavailable = ({data: part}) => parts.push(part);
  film.start();
  try {
    await eachFrame(async () => {
      composeView();
      await pauseFor(1000 / run.framesPerSecond);
    }, goesOn);
  } finally {
    film.stop();
  }
  await done;
  return new Blob(parts, {type: videoType});
}

async function saveFrames(goesOn) {
  if (!videoType) {
    await eachFrame(async () => saveAs(await pictureBlob(), frameName() + ".png"), goesOn);
    return;
  }
  const film = await filmFrames(goesOn);
  if (goesOn()) saveAs(film, videoType.startsWith("video/mp4") ? ".mp4" : ".webm");
}

let exporting = false;
async function saveVideo() {
  if (exporting) {
    exporting = false;
    return;
  }
  exporting = true;
  element("save-video").textContent = "Stop";
  sayExport("Saving all frames. This takes as long as the run plays.");
  try {
    await saveFrames(() => exporting);
    sayExport(exporting ? "Saved." : "Stopped; no video was saved.");
  } catch ({message}) {
    sayExport(`The video is not saved: ${message}.`, true);
  }
  exporting = false;
  element("save-video").textContent = "Save video";
}
