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
