// Progress in the formats of printf.
#pragma once

#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/print_text.h"

namespace fulcrum::scene {

template <class... Values>
void Say(const Progress& progress, const char* format, Values... values) {
  if (progress) progress(PrintText(format, values...));
}

}  // namespace fulcrum::scene
