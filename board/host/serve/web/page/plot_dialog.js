// Dialog in which the user chooses the signals of a plot.
import {signals} from './chart_list.js';
import {isLayout, kDefaultPlots, kMostPlots, set, settings} from './settings.js';
import {make} from './tools.js';

const element = id => document.getElementById(id);

export class PlotDialog {
  /// changed(): the layout is another one.
  constructor(changed) {
    this.dialog = element('plot_dialog');
    const act = (id, plots) => element(id).addEventListener('click', () => {
      const layout = plots(), fits = isLayout(layout);
      element('plot_why').textContent = fits ? '' : `Choose a signal; the page has room for ${kMostPlots} plots.`;
      if (!fits) return;
      this.dialog.close();
      set('plots', layout);
      changed();
    });
    act('plot_set', () => this.#with(this.chosen.length ? [{signals: this.chosen, deviation: element('plot_deviation').checked}] : []));
    act('plot_split', () => this.#with(this.chosen.map(name => ({signals: [name], deviation: element('plot_deviation').checked}))));
    act('plot_remove', () => this.#with([]));
    act('plot_default', () => kDefaultPlots);
  }

  /// index: of the plot; undefined: a new one.
  open(index) {
    this.index = index ?? settings.plots.length;
    const plot = settings.plots[this.index] ?? {signals: [], deviation: false};
    const all = Object.values(signals());
    const box = ({name, label}) => make('label', {}, make('input', {type: 'checkbox', name, checked: plot.signals.includes(name)}), ` ${label}`);
    element('plot_signals')
        .replaceChildren(...[...new Set(all.map(({group}) => group))].map(
            group => make('fieldset', {}, make('legend', {}, group), ...all.filter(signal => signal.group === group).map(box))));
    element('plot_deviation').checked = plot.deviation;
    element('plot_remove').disabled = settings.plots.length < 2 || index === undefined;
    element('plot_set').disabled = element('plot_split').disabled = settings.plots.length >= kMostPlots && index === undefined;
    element('plot_why').textContent = '';
    this.dialog.showModal();
  }

  get chosen() { return [...element('plot_signals').querySelectorAll('input:checked')].map(({name}) => name); }

  /// The layout with other plots in place of this one.
  #with(plots) { return [...settings.plots.slice(0, this.index), ...plots, ...settings.plots.slice(this.index + 1)]; }
}
