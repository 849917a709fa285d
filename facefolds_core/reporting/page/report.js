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
    const [zoom, blink] = ["zoom", "blink"].map((id) => document.getElementById(id));
    const spread = (change) => {
      for (const view of views) change(view);
    };
    zoom.addEventListener("change", () => spread((view) => {
      view.style.setProperty("--zoom", zoom.value);
      view.classList.toggle("zoomed", zoom.value !== "1");
      for (const pan of view.querySelectorAll(".pan")) {
        pan.scrollLeft = (pan.scrollWidth - pan.clientWidth) / 2;
        pan.scrollTop = (pan.scrollHeight - pan.clientHeight) / 2;
      }
    }));
    // Where a picture is moved, its error goes with it.
    for (const view of views) {
      const pans = [...view.querySelectorAll(".pan")];
      for (const pan of pans) pan.addEventListener("scroll", () => {
        for (const other of pans) if (other !== pan) [other.scrollLeft, other.scrollTop] = [pan.scrollLeft, pan.scrollTop];
      });
    }
    blink.addEventListener("click", () => {
      const on = blink.getAttribute("aria-pressed") !== "true";
      blink.setAttribute("aria-pressed", String(on));
      spread((view) => view.classList.toggle("blink", on));
    });
    show(0); // a browser that comes back to the page keeps the choice of the list only
  }
}

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
