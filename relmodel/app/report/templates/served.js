// Of pages that a server gives; a page that is a file fetches nothing.
{
  // Runs that begin or end appear by themselves.
  const list = document.querySelector("[data-newest]");
  if (list) setInterval(async () => {
    if (document.hidden) return;
    try {
      const said = await (await fetch("/newest")).text();
      if (!/^\d+ \d+$/.test(said) || said === list.dataset.newest) return;
      const page = new DOMParser().parseFromString(await (await fetch(location.href)).text(), "text/html").getElementById("rows");
      if (page) { list.dataset.newest = page.dataset.newest; list.replaceChildren(...page.childNodes); }
    } catch { /* the server is away, or the store is being written to: the next time */ }
  }, 3000);
}
