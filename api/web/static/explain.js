// Explanations on the runs of the campaign that is shown: submit, follow, read the report.
"use strict";

let explanations = [];

function explanationsOfCampaign() {
  const campaign = one();
  if (!campaign) return;
  const captured = campaign.tests.some((test) => test.state === "done" && !test.held_out);
  at("ask").disabled = asking || !captured;
  at("asked").textContent = asking ? "checking the runs and the model …"
    : captured ? "" : "possible after a training test is captured";
  at("explanations").replaceChildren(
    ...explanations.filter((one) => one.campaign === campaign.id).map(explanationLine));
}

function explanationLine(one) {
  const item = make("li", "explanation");
  const title = make("div", "row");
  title.append(make("span", "name", one.name), make("span", "state " + one.state, one.state));
  item.append(title);
  if (one.reason) item.append(make("p", "text", one.reason));
  if (one.state === "running") item.append(make("p", "hint", one.phase), bar(one.done));
  if (one.state === "done") {
    const found = one.effects.map((e) => `${e.element} (confidence ${e.confidence.toFixed(2)})`).join(", ");
    item.append(make("p", "", one.verdict.replaceAll("_", " ") + (found ? ": " + found : "")));
    const links = make("p", "hint");
    const files = [["Report", one.report_html], ["report.json", one.report], ["evidence.h5", one.evidence],
      ["model.json", one.model]];
    for (const [text, url] of files) {
      const link = make("a", "", text);
      link.href = url;
      link.target = "_blank";
      links.append(link, " ");
    }
    item.append(links);
  }
  if (["accepted", "running"].includes(one.state)) {
    const button = make("button", "cancel", "Cancel");
    button.type = "button";
    button.addEventListener("click", () => sendExplain(`/v1/explanations/${one.id}/cancel`, {}));
    item.append(button);
  }
  return item;
}

let asking = false;

async function sendExplain(url, body) {
  const answer = await fetch(url, {
    method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body),
  });
  if (!answer.ok) throw new Error((await answer.json()).detail);
}

async function askForExplanation(event) {
  event.preventDefault();
  const campaign = one();
  const file = at("model").files[0];
  if (!campaign || !file) return;
  asking = true;
  explanationsOfCampaign();
  let refused = "";
  try {
    let model;
    try {
      model = JSON.parse(await file.text());
    } catch (error) {
      throw new Error(`${file.name}: no JSON (${error.message})`);
    }
    await sendExplain("/v1/explanations", { campaign: campaign.id, model });
  } catch (error) {
    refused = error.message;
  }
  asking = false;
  explanationsOfCampaign();
  at("refused").hidden = !refused;
  at("refused").textContent = refused;
}

document.getElementById("explain").addEventListener("submit", askForExplanation);
