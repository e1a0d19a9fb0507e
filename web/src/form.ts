// The bench by number: a field for every setting that the library declares, with its own words.

import { h } from "./dom";
import type { Engine } from "./engine";
import type { Catalogue, Setting } from "./protocol";
import { valueOf, type State } from "./state";
import { choiceHint, groupName, hintOf, say, settingName } from "./strings";

/** These have their own place: beside the picture, or in "Make it". */
const ELSEWHERE = new Set(["preset", "crop", "rotate", "flip", "levels", "invert", "offset", "background", "nodes"]);
/** A file of more bytes is none that a setting names. */
const MOST_MB = 64;

type Field = HTMLInputElement | HTMLSelectElement;

export class Form {
  readonly element: HTMLElement;
  private readonly fields = new Map<string, { field: Field; fault: HTMLElement; setting: Setting }>();
  private readonly presets: HTMLSelectElement;
  private readonly fileList = h("ul", { id: "other-file-list" });
  private readonly fileFault = h("p", { class: "fault", role: "alert", hidden: true });

  constructor(
    private readonly state: State,
    private readonly engine: Engine,
    private readonly catalogue: Catalogue,
  ) {
    const groups = new Map<string, Setting[]>();
    for (const setting of catalogue.settings) {
      if (ELSEWHERE.has(setting.name)) continue;
      groups.set(setting.group, [...(groups.get(setting.group) ?? []), setting]);
    }
    this.presets = h(
      "select",
      { id: "preset", onchange: () => this.applyPreset() },
      h("option", { value: "" }, say("noPreset")),
      ...catalogue.presets.map(({ name, help }) => h("option", { value: name }, choiceHint("preset", name, help || name))),
    );
    const usual = [...groups.values()].flat().filter((setting) => !setting.rare);
    const rare = [...groups].map(([group, settings]) => [group, settings.filter((setting) => setting.rare)] as const).filter(([, settings]) => settings.length > 0);
    this.element = h(
      "section",
      { class: "panel", "aria-labelledby": "bench-title" },
      h("h2", { id: "bench-title" }, say("bench")),
      h("label", { class: "setting" }, h("span", {}, say("preset")), this.presets),
      h("div", { class: "settings" }, ...usual.map((setting) => this.field(setting))),
      h(
        "details",
        { id: "more-settings" },
        h("summary", {}, say("more")),
        this.otherFiles(),
        ...rare.map(([group, settings]) => h("fieldset", {}, h("legend", {}, groupName(group)), h("div", { class: "settings" }, ...settings.map((setting) => this.field(setting))))),
      ),
    );
  }

  /** Files that settings name, given to the page by name. */
  private otherFiles(): HTMLElement {
    const input = h("input", { type: "file", multiple: true, id: "other-files", class: "visually-hidden", onchange: () => void this.takeFiles(input) });
    return h("fieldset", {}, h("legend", {}, say("otherFiles")), h("p", { class: "hint" }, say("otherFilesHelp")), h("label", { for: "other-files", class: "button" }, say("choose")), input, this.fileFault, this.fileList);
  }

  private async takeFiles(input: HTMLInputElement): Promise<void> {
    this.fileFault.hidden = true;
    const taken: [string, Uint8Array][] = [];
    for (const file of input.files ?? []) {
      const mb = file.size / 1e6;
      if (mb > MOST_MB) {
        this.fileFault.hidden = false;
        this.fileFault.textContent = say("tooLarge", { name: file.name, mb: mb.toFixed(0), most: MOST_MB });
      } else taken.push([file.name, new Uint8Array(await file.arrayBuffer())]);
    }
    this.state.addFiles(taken);
    input.value = "";
  }

  private field(setting: Setting): HTMLElement {
    const { name, help, more } = setting;
    const id = `setting-${name}`;
    const change = () => void this.change(setting);
    const meaning = hintOf(name, [help, more].filter(Boolean).join(". "));
    const hint = h("small", { id: `${id}-hint`, class: "hint" }, meaning);
    const fault = h("small", { id: `${id}-fault`, class: "fault", role: "alert", hidden: true });
    const described = { id, "aria-describedby": `${id}-hint ${id}-fault`, onchange: change };
    const choices = name === "material" ? this.catalogue.materials.map(({ name, description, ior }) => ({ name, help: `${description}, n = ${ior}` })) : setting.choices;
    let field: Field;
    if (setting.is_switch) {
      field = h("input", { ...described, type: "checkbox" });
    } else if (choices.length > 0) {
      const label = (choice: { name: string; help: string }) => (choice.help ? `${choice.name}: ${choiceHint(name, choice.name, choice.help)}` : choice.name);
      field = h("select", described, h("option", { value: "" }, `(${say("byDefault")})`), ...choices.map((choice) => h("option", { value: choice.name }, label(choice))));
    } else {
      const usual = /\[(?:default|Vorgabe): ([^\]]*)\]/.exec(meaning)?.[1];
      field = h("input", { ...described, type: "text", placeholder: usual ?? setting.value, autocomplete: "off", spellcheck: "false" });
    }
    this.fields.set(name, { field, fault, setting });
    return h("div", { class: "setting" }, h("label", { for: id }, settingName(name), h("span", { class: "unit" }, setting.is_switch || choices.length ? "" : setting.value.toLowerCase())), field, hint, fault);
  }

  /** Takes what was written, if it means something to the library. */
  private async change(setting: Setting): Promise<void> {
    const { field, fault } = this.fields.get(setting.name) ?? {};
    if (!field || !fault) return;
    const value = field instanceof HTMLInputElement && field.type === "checkbox" ? field.checked || null : field.value.trim() === "" ? null : valueOf(field.value.trim());
    const wrong = value === null ? null : await this.engine.call<string | null>({ method: "fault_of", args: [JSON.stringify({ [setting.name]: value })] });
    fault.hidden = !wrong;
    fault.textContent = wrong ?? "";
    field.setAttribute("aria-invalid", String(Boolean(wrong)));
    if (wrong) return;
    const changes = { [setting.name]: value };
    // One says what the other says: the last word holds.
    if (value !== null && setting.name === "ior") changes.material = null;
    if (value !== null && setting.name === "material") changes.ior = null;
    this.state.set(changes);
  }

  private applyPreset(): void {
    const preset = this.catalogue.presets.find(({ name }) => name === this.presets.value);
    if (!preset) return;
    const settings = Object.fromEntries(Object.entries(preset.settings).filter(([, value]) => value !== null));
    const { crop, rotate, flip, levels, invert, background } = this.state.settings;
    const kept = Object.fromEntries(Object.entries({ crop, rotate, flip, levels, invert, background }).filter(([, value]) => value !== undefined));
    this.state.replace({ ...settings, ...kept } as typeof settings);
  }

  /** Shows the settings as they are. */
  update(): void {
    const remove = (name: string) => h("button", { type: "button", "aria-label": `${say("remove")}: ${name}`, onclick: () => this.state.removeFile(name) }, say("remove"));
    this.fileList.replaceChildren(...[...this.state.files.keys()].map((name) => h("li", { class: "row" }, h("code", {}, name), remove(name))));
    for (const [name, { field, fault }] of this.fields) {
      const value = this.state.settings[name];
      if (document.activeElement === field && field instanceof HTMLInputElement && field.type === "text") continue;
      if (field instanceof HTMLInputElement && field.type === "checkbox") field.checked = value === true;
      else field.value = value === undefined || value === null ? "" : String(value);
      fault.hidden = true;
    }
  }
}
