// Frames of replays are as tall as the replay in them, whose height depends on the width, the controllers and the charts.
addEventListener("message", ({ data, source }) => {
  const frame = [...document.querySelectorAll(".replay-frame")].find((one) => one.contentWindow === source);
  if (frame && Number.isFinite(data?.replayHeight)) frame.style.height = `${Math.min(Math.ceil(data.replayHeight), 4000)}px`;
});
