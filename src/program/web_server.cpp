#include "web_server.hpp"

#include "dynains/errors.hpp"

#if defined(DYNAINS_HAS_HTTPLIB)

#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "run/interrupt.hpp"

namespace dynains::program {
namespace {

constexpr const char* kLoopback = "127.0.0.1";

/// Pages of other sites must not read through a name of their own for this machine.
bool is_our_name(const std::string& host) {
  const std::string name = host.substr(0, host.find(':'));
  return name == kLoopback || name == "localhost";
}

/// SO_REUSEPORT, which the library sets by default, would let two servers share a port.
void allow_port_after_restart(socket_t socket) {
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

void set_up(httplib::Server& server, const WebAnswers& answers) {
  server.set_socket_options(allow_port_after_restart);
  server.set_tcp_nodelay(true);
  server.set_keep_alive_max_count(10000);
  server.set_keep_alive_timeout(1);  // s; a stop waits for it
  server.set_default_headers(
      {{"Cache-Control", "no-store"},
       {"X-Content-Type-Options", "nosniff"},
       {"Content-Security-Policy",
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        "img-src data:; connect-src 'self'"}});
  server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
    if (is_our_name(request.get_header_value("Host"))) {
      return httplib::Server::HandlerResponse::Unhandled;
    }
    response.status = 403;
    return httplib::Server::HandlerResponse::Handled;
  });
  server.Get(".*", [&answers](const httplib::Request& request, httplib::Response& response) {
    if (const std::optional<WebAnswer> answer = answers(request.path)) {
      response.set_content(answer->content, answer->type);
    } else {
      response.status = 404;
    }
  });
}

int open_port(httplib::Server& server, int port) {
  if (port == 0) {
    const int any = server.bind_to_any_port(kLoopback);
    if (any > 0) return any;
    throw ConfigError("no port can be opened on " + std::string(kLoopback));
  }
  if (server.bind_to_port(kLoopback, port)) return port;
  throw ConfigError("--port " + std::to_string(port) +
                    ": cannot be opened, another program may use it; choose another port, or leave "
                    "out --port for a free one");
}

}  // namespace

void serve_web(int port, const WebAnswers& answers, const std::function<void(int port)>& is_ready) {
  httplib::Server server;
  set_up(server, answers);
  const InterruptGuard interrupt;
  is_ready(open_port(server, port));
  std::atomic<bool> has_ended{false};
  std::thread listener([&] {
    server.listen_after_bind();
    has_ended = true;
  });
  const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); };
  while (InterruptGuard::signal() == 0 && !has_ended) wait();
  // A server that does not run yet cannot be stopped.
  while (!server.is_running() && !has_ended) wait();
  server.stop();
  listener.join();
  if (InterruptGuard::signal() == 0) throw IoError("the web server ended by itself");
}

}  // namespace dynains::program

#else

namespace dynains::program {

void serve_web(int, const WebAnswers&, const std::function<void(int port)>&) {
  throw ConfigError(
      "--serve: this program was built without a web server; install cpp-httplib (Debian: "
      "libcpp-httplib-dev) and build it again");
}

}  // namespace dynains::program

#endif
