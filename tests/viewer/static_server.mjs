// Serves the files of a folder on the loopback interface, for tests.
import {createServer} from 'node:http';
import {existsSync, readFileSync} from 'node:fs';
import {join, normalize} from 'node:path';

// Resolves to {address, close()}; the address ends in "/".
export function serveFolder(folder) {
  const server = createServer((request, answer) => {
    const file = join(folder, normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname)));
    if (!existsSync(file)) {
      answer.writeHead(404).end();
      return;
    }
    answer.writeHead(200, file.endsWith('.html') ? {'content-type': 'text/html; charset=utf-8'} : {});
    answer.end(readFileSync(file));
  });
  return new Promise((resolve) => {
    server.listen(0, '127.0.0.1', () => resolve({
      address: `http://127.0.0.1:${server.address().port}/`,
      close: () => new Promise((closed) => {
        server.close(closed);
        server.closeAllConnections();
      }),
    }));
  });
}
