"use strict";
{
  // Films: truth and asset side by side, every frame of every held-out camera.
  const films = JSON.parse(document.querySelector("#films-data").textContent);
  const video = document.querySelector("#film");
  if (video && films.length) {
    const [play, slider, name, camera, how, zoom] =
      ["play", "frame", "frame-name", "camera", "film-how", "film-zoom"].map((id) => document.getElementById(id));
    const screen = video.closest(".screen");
    let film = films[0];
    const frameAt = (time) => Math.min(film.frames.length - 1, Math.floor(time * film.fps + 1e-6));
    const tell = () => {
      const frame = frameAt(video.currentTime);
      slider.value = String(frame);
      name.textContent = film.labels[frame];
      play.textContent = video.paused ? "▶" : "❚❚";
    };
    // The middle of a frame: its edges belong to neither of two.
    const seek = (frame) => { video.currentTime = (frame + 0.5) / film.fps; name.textContent = film.labels[frame]; };
    const step = (by) => {
      video.pause();
      seek((frameAt(video.currentTime) + by + film.frames.length) % film.frames.length);
    };
    const middle = () => {
      screen.scrollLeft = (screen.scrollWidth - screen.clientWidth) / (how.value === "beside" ? 4 : 2);
      screen.scrollTop = (screen.scrollHeight - screen.clientHeight) / 2;
    };

    slider.addEventListener("input", () => { video.pause(); seek(Number(slider.value)); });
    play.addEventListener("click", () => (video.paused ? video.play() : video.pause()));
    camera.addEventListener("change", () => {
      const [paused, frame] = [video.paused, frameAt(video.currentTime)];
      film = films[Number(camera.value)];
      slider.max = String(film.frames.length - 1);
      video.setAttribute("src", film.src);
      video.addEventListener("loadedmetadata", () => seek(Math.min(frame, film.frames.length - 1)), { once: true });
      if (!paused) video.play();
    });
    how.addEventListener("change", () => {
      screen.dataset.how = how.value;
      middle();
    });
    zoom.addEventListener("change", () => {
      screen.style.setProperty("--zoom", zoom.value);
      screen.classList.toggle("zoomed", zoom.value !== "1");
      middle();
    });
    screen.tabIndex = 0;
    video.addEventListener("loadedmetadata", () => seek(0), { once: true });
    screen.addEventListener("keydown", (event) => {
      const act = { " ": () => play.click(), ArrowLeft: () => step(-1), ArrowRight: () => step(1) }[event.key];
      if (!act || zoom.value !== "1" && event.key !== " ") return;
      event.preventDefault();
      act();
    });
    for (const event of ["timeupdate", "seeked", "play", "pause", "loadeddata"]) video.addEventListener(event, tell);
    const follow = () => { tell(); if (!video.paused) requestAnimationFrame(follow); };
    video.addEventListener("play", () => requestAnimationFrame(follow));
    const seen = new IntersectionObserver((entries) => { if (!entries.at(-1).isIntersecting) video.pause(); });
    seen.observe(video);
  }
}
