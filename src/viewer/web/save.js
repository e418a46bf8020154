// What is saved from the page: the picture as it stands, and a video of the whole way.

export function keep(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export function savePicture(canvas, name) {
  return new Promise((done) => canvas.toBlob((blob) => { keep(blob, `${name}.png`); done(blob.size); }, 'image/png'));
}

export const canRecord = (canvas) => typeof MediaRecorder !== 'undefined' && !!canvas.captureStream;

/** Plays the way once, forwards, and saves it; `show` draws a time. */
export async function saveVideo(canvas, name, seconds, show) {
  const kinds = ['video/mp4;codecs=avc1.640028', 'video/webm;codecs=vp9', 'video/webm'];
  const kind = kinds.find((one) => MediaRecorder.isTypeSupported(one)) || '';
  const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: kind, videoBitsPerSecond: 8e6 });
  const pieces = [];
  recorder.ondataavailable = (event) => pieces.push(event.data);
  const ended = new Promise((done) => { recorder.onstop = done; });
  recorder.start();
  const begun = performance.now();
  await new Promise((done) => {
    const step = () => {
      const t = (performance.now() - begun) / (1000 * seconds);
      show(Math.min(1, t));
      if (t < 1.08) requestAnimationFrame(step); else done();
    };
    requestAnimationFrame(step);
  });
  recorder.stop();
  await ended;
  const blob = new Blob(pieces, { type: kind.split(';')[0] });
  keep(blob, `${name}.${kind.includes('mp4') ? 'mp4' : 'webm'}`);
  return blob.size;
}
