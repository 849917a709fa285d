"use strict";
{
  const views = [...document.querySelectorAll(".view")];
  const select = document.querySelector("#view");

  const show = (index) => {
    const wanted = (index + views.length) % views.length;
    views.forEach((view, i) => { view.hidden = i !== wanted; });
    select.value = String(wanted);
  };
  // One divider for all pictures, so that it stays where it is from one to the next.
  const cut = (percent) => {
    const value = Math.min(100, Math.max(0, percent));
    for (const view of views) {
      view.querySelector(".wipe").style.setProperty("--cut", `${value}%`);
      view.querySelector(".cut").value = String(value);
    }
  };

  for (const view of views) {
    const wipe = view.querySelector(".wipe");
    const follow = (event) => {
      const box = wipe.getBoundingClientRect();
      cut((100 * (event.clientX - box.left)) / box.width);
    };
    wipe.addEventListener("pointerdown", (event) => {
      wipe.setPointerCapture(event.pointerId);
      follow(event);
    });
    wipe.addEventListener("pointermove", (event) => {
      if (wipe.hasPointerCapture(event.pointerId)) follow(event);
    });
    view.querySelector(".cut").addEventListener("input", (event) => cut(Number(event.target.value)));
  }
  if (views.length) {
    select.addEventListener("change", () => show(Number(select.value)));
    document.querySelector("#previous").addEventListener("click", () => show(Number(select.value) - 1));
    document.querySelector("#next").addEventListener("click", () => show(Number(select.value) + 1));
    for (const link of document.querySelectorAll("[data-show]")) {
      link.addEventListener("click", () => show(Number(link.dataset.show)));
    }
    show(0); // a browser that comes back to the page keeps the choice of the list only
  }
}

{
  // Films: truth and asset side by side, every frame of every held-out camera.
  const films = JSON.parse(document.querySelector("#films-data").textContent);
  const video = document.querySelector("#film");
  if (video && films.length) {
    const [play, slider, name, camera, zoom] =
      ["play", "frame", "frame-name", "camera", "zoom"].map((id) => document.getElementById(id));
    let film = films[0];
    const frameAt = (time) => Math.min(film.frames.length - 1, Math.floor(time * film.fps + 1e-6));
    const tell = () => {
      const frame = frameAt(video.currentTime);
      slider.value = String(frame);
      name.textContent = film.frames[frame];
      play.textContent = video.paused ? "▶" : "❚❚";
    };
    // The middle of a frame: its edges belong to neither of two.
    const seek = (frame) => { video.currentTime = (frame + 0.5) / film.fps; name.textContent = film.frames[frame]; };

    slider.addEventListener("input", () => { video.pause(); seek(Number(slider.value)); });
    play.addEventListener("click", () => (video.paused ? video.play() : video.pause()));
    camera.addEventListener("change", () => {
      const paused = video.paused;
      film = films[Number(camera.value)];
      slider.max = String(film.frames.length - 1);
      video.setAttribute("src", film.src);
      if (!paused) video.play();
    });
    zoom.addEventListener("change", () => {
      const screen = video.parentElement;
      screen.style.setProperty("--zoom", zoom.value);
      screen.classList.toggle("zoomed", zoom.value !== "1");
      screen.scrollLeft = (screen.scrollWidth - screen.clientWidth) / 4; // into the photo's middle
      screen.scrollTop = (screen.scrollHeight - screen.clientHeight) / 2;
    });
    for (const event of ["timeupdate", "seeked", "play", "pause", "loadeddata"]) video.addEventListener(event, tell);
    const step = () => { tell(); if (!video.paused) requestAnimationFrame(step); };
    video.addEventListener("play", () => requestAnimationFrame(step));
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) video.play().catch(() => {});
  }
}
