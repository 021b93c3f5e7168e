// Saves the view as a PNG file, and the run as a video, or as a PNG file for each frame if the
// browser cannot record videos.
const pictureCanvas = document.createElement("canvas");

// Draws background, scene, scale bar and frame number on a canvas, and returns it.
function composeView() {
  render();
  const ratio = canvas.width / Math.max(canvas.clientWidth, 1), {width, height} = canvas;
  // Video encoders need even sizes.
  pictureCanvas.width = width - width % 2;
  pictureCanvas.height = height - height % 2;
  const pen = pictureCanvas.getContext("2d");
  const paper = pen.createLinearGradient(0, 0, 0, height);
  paper.addColorStop(0, css("--stage-top"));
  paper.addColorStop(1, css("--stage-bottom"));
  pen.fillStyle = paper;
  pen.fillRect(0, 0, width, height);
  pen.drawImage(canvas, 0, 0);
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  const right = width / ratio - 14, bottom = height / ratio - 12, left = right - scaleBar.pixels;
  pen.fillStyle = pen.strokeStyle = css("--ink");
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(left, bottom - 7);
  pen.lineTo(left, bottom);
  pen.lineTo(right, bottom);
  pen.lineTo(right, bottom - 7);
  pen.stroke();
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.fillText(scaleBar.text, (left + right) / 2, bottom - 6);
  pen.textAlign = "left";
  pen.fillText(`${document.title}, frame ${frameShown + 1} of ${run.frames.length}`, 12, bottom);
  return pictureCanvas;
}

const pictureBlob = () => new Promise((resolve) => composeView().toBlob(resolve, "image/png"));
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

async function savePicture() {
  saveAs(await pictureBlob(), frameName() + ".png");
}

const videoType = ["video/webm;codecs=vp9", "video/webm", "video/mp4"].find((type) =>
  window.MediaRecorder && MediaRecorder.isTypeSupported(type));

// Shows all frames and calls work(frame) for each, while goesOn() returns true.
async function eachFrame(work, goesOn) {
  const before = frameShown;
  pause();
  for (let frame = 0; frame < run.frames.length && goesOn(); ++frame) {
    show(frame);
    await work(frame);
  }
  show(before);
}

// Records all frames as a video, at the speed of the player.
async function filmFrames(goesOn) {
  const film = new MediaRecorder(composeView().captureStream(), {mimeType: videoType,
    videoBitsPerSecond: 8e6});
  const parts = [], done = new Promise((resolve) => { film.onstop = resolve; });
  film.ondataavailable = ({data: part}) => parts.push(part);
  film.start();
  await eachFrame(async () => {
    composeView();
    await pauseFor(1000 / run.framesPerSecond);
  }, goesOn);
  film.stop();
  await done;
  return new Blob(parts, {type: videoType});
}

let exporting = false;
async function saveVideo() {
  const button = element("save-video"), say = (text) => { element("export-status").textContent = text; };
  if (exporting) {
    exporting = false;
    return;
  }
  exporting = true;
  button.textContent = "Stop";
  say("Saving all frames. This takes as long as the run plays.");
  if (videoType) {
    const film = await filmFrames(() => exporting);
    if (exporting) saveAs(film, videoType.startsWith("video/mp4") ? ".mp4" : ".webm");
  } else {
    await eachFrame(async () => saveAs(await pictureBlob(), frameName() + ".png"), () => exporting);
  }
  say(exporting ? "Saved." : "Stopped; no video was saved.");
  exporting = false;
  button.textContent = "Save video";
}
