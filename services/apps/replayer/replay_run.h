// replayer --into: replay of nodes, unchanged or with changed parameters, in one run or controlled by commands.
#pragma once

#include "services/apps/replayer/options.h"

namespace fulcrum::replay {

/// Prints the result and writes it to `options.json`. Returns the exit code: 0 when all states were equal, 1 when one
/// differed or the recording is incomplete. Throws InputError, MismatchError, std::runtime_error.
int RunReplay(const Options& options);

/// replayer --film, on standard input and output; see ShowFilm(). Returns the exit code; throws the same.
int RunFilm(const Options& options);

/// replayer --video; see MakeVideo(). Prints the result and writes it to `options.json`. Returns the exit code; throws
/// the same.
int RunVideo(const Options& options);

/// replayer --dataset; see MakeDataset(). Prints the result and writes it to `options.json`. Returns the exit code;
/// throws the same.
int RunDataset(const Options& options);

/// replayer --lerobot; see MakeLerobot(). Prints the result and writes it to `options.json`. Returns the exit code;
/// throws the same.
int RunLerobot(const Options& options);

}  // namespace fulcrum::replay
