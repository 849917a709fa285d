// Browsers load no modules from files: said here, by a script that is none.
if (location.protocol === "file:") {
  const words = document.getElementById("words");
  words.textContent =
    "This page was opened as a file, and browsers let such a page read no other files. Serve the folder (facefolds view ASSET), " +
    "or make one file that plays by itself: facefolds export-html ASSET --out face.html";
  words.hidden = false;
  document.querySelector("facefolds-player").remove();
}
