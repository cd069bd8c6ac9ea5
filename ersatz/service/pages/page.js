// What pages do without asking the server: light and dark, and copying. No data is made into markup here.
addEventListener('load', () => {
  const dark = localStorage.getItem('ersatz-dark');
  if (dark !== null && window.Quasar) Quasar.Dark.set(dark === 'true');
});

function ersatzCopy(words, button) {
  const done = () => { const was = button.textContent; button.textContent = 'copied'; setTimeout(() => { button.textContent = was; }, 1500); };
  const byHand = () => { // where the page is not loopback nor https, browsers have no clipboard
    const area = document.createElement('textarea');
    area.value = words;
    document.body.append(area);
    area.select();
    document.execCommand('copy');
    area.remove();
    done();
  };
  if (navigator.clipboard) navigator.clipboard.writeText(words).then(done, byHand); else byHand();
}

document.addEventListener('click', event => {
  const button = event.target.closest && event.target.closest('[data-do]');
  if (!button) return;
  if (button.dataset.do === 'dark') {
    Quasar.Dark.toggle();
    localStorage.setItem('ersatz-dark', Quasar.Dark.isActive);
  } else if (button.dataset.do === 'copy') {
    ersatzCopy(button.dataset.words, button);
  } else if (button.dataset.do === 'copy-link') {
    ersatzCopy(location.href, button);
  } else if (button.dataset.do === 'copy-table') {
    const rows = [...button.closest('.copyable').querySelectorAll('tr')];
    ersatzCopy(rows.map(row => [...row.cells].map(cell => cell.innerText.replace(/\s+/g, ' ').trim()).join('\t')).join('\n'), button);
  }
});
