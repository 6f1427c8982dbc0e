#include "services/session/supervisor/refusal_journal.h"

namespace fulcrum::supervisor {

void RefusalJournal::Take(const std::array<bus::Refusals, kSources>& sources,
                          const std::function<void(const std::string&)>& on_new) {
  all_.participants = all_.endpoints = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    all_.participants += sources[i].participants;
    all_.endpoints += sources[i].endpoints;
    for (; taken_[i] < sources[i].texts.size(); ++taken_[i]) {
      all_.texts.push_back(sources[i].texts[taken_[i]]);
      on_new(all_.texts.back());
    }
  }
}

}  // namespace fulcrum::supervisor
