/* Filters and order of the gallery. */
'use strict';
(() => {
  const list = document.getElementById('gallery'), entries = [...list.children], filters = [...document.querySelectorAll('[data-filter]')];
  const sort = document.getElementById('sort');
  function apply() {
    const key = sort.value, numbers = (entry) => Number(entry.dataset[key] || -Infinity);
    entries.sort((a, b) => numbers(b) - numbers(a)).forEach((entry) => list.append(entry));
    entries.forEach((entry) => { entry.hidden = !filters.every(({ value, dataset }) => !value || entry.dataset[dataset.filter] === value); });
    const count = entries.filter(({ hidden }) => !hidden).length;
    document.getElementById('shown').textContent = `${count} of ${entries.length} dances`;
  }
  [...filters, sort].forEach((select) => select.addEventListener('change', apply));
  /* After Back a browser restores the choices once the scripts have run. */
  addEventListener('pageshow', apply);
  apply();
})();
