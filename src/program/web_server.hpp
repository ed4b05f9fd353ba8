// A web server for programs on this machine.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace dynains::program {

struct WebAnswer {
  std::string content;
  const char* type;  ///< MIME type
};

/// The answer to GET `path`, which begins with "/" and is decoded; nothing: not found. Called by
/// several threads at once.
using WebAnswers = std::function<std::optional<WebAnswer>(const std::string& path)>;

/// Answers on the loopback interface until SIGINT or SIGTERM. `port` 0: any free port. Calls
/// `is_ready(port)` before the first answer. A request under another host name than 127.0.0.1 or
/// localhost is refused. Throws ConfigError if the port cannot be opened or if the program was
/// built without cpp-httplib.
void serve_web(int port, const WebAnswers& answers, const std::function<void(int port)>& is_ready);

}  // namespace dynains::program
