// The API key, where the service wants one: asked for when it does, kept until the tab is closed.

import { $ } from "./dom.js";

const PLACE = "api-key";

class Keyring extends EventTarget {
  #key = null;

  constructor() {
    super();
    try {
      this.#key = sessionStorage.getItem(PLACE);
    } catch {
      // Storage is forbidden: the key lasts as long as the page.
    }
  }

  /** Whether this service serves those with a key alone, as far as is known. */
  get wanted() {
    return this.#key !== null;
  }

  get headers() {
    return this.#key === null ? {} : { Authorization: `Bearer ${this.#key}` };
  }

  /**
   * What `attempt(headers)` comes to, once it is not refused for want of a key.
   *
   * The refusal itself is thrown when the user has none to give.
   */
  async unlock(attempt) {
    for (;;) {
      const tried = this.#key;
      try {
        return await attempt(this.headers);
      } catch (error) {
        if (error.status !== 401) throw error;
        // Another request may have come by a key meanwhile.
        if (this.#key === tried && !(await this.#ask(error.code === "key_unknown"))) throw error;
      }
    }
  }

  /** One dialog for all requests that wait; whether it gave a key. */
  #ask(refused) {
    this.asking ??= this.#dialog(refused).finally(() => {
      this.asking = null;
    });
    return this.asking;
  }

  #dialog(refused) {
    const [dialog, field] = [$("key-dialog"), $("key-field")];
    $("key-fault").textContent = refused ? "The service does not know this key." : "";
    field.setAttribute("aria-invalid", String(refused));
    field.value = "";
    dialog.returnValue = "";
    dialog.showModal();
    field.focus();
    return new Promise((resolve) => {
      $("key-form").onsubmit = (event) => {
        event.preventDefault();
        dialog.close(field.value.trim());
      };
      $("key-cancel").onclick = () => dialog.close("");
      dialog.onclose = () => {
        field.value = "";
        const { returnValue } = dialog;
        dialog.returnValue = "";
        if (returnValue) this.#keep(returnValue);
        resolve(Boolean(returnValue));
      };
    });
  }

  #keep(key) {
    this.#key = key;
    try {
      sessionStorage.setItem(PLACE, key);
    } catch {
      // As above.
    }
    this.dispatchEvent(new Event("change"));
  }
}

export const keyring = new Keyring();
