/* A client of `seldinger serve` in C: it pushes the wire through the straight tube until the target is reached.
 *
 *     cc -o serve_client serve_client.c && ./serve_client seldinger straight
 */
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static FILE* to_server;
static FILE* from_server;

/* Starts the program with its standard input and output in our hands. */
static pid_t start(const char* program, const char* scenario) {
    int in[2], out[2];
    if (pipe(in) != 0 || pipe(out) != 0) {
        perror("pipe");
        exit(1);
    }
    const pid_t child = fork();
    if (child == 0) {
        dup2(in[0], STDIN_FILENO);
        dup2(out[1], STDOUT_FILENO);
        close(in[0]), close(in[1]), close(out[0]), close(out[1]);
        execlp(program, program, "serve", scenario, (char*)NULL);
        perror(program);
        _exit(127);
    }
    close(in[0]), close(out[1]);
    to_server = fdopen(in[1], "w");
    from_server = fdopen(out[0], "r");
    return child;
}

/* The next answer: one line of JSON. */
static const char* answer(void) {
    static char* line = NULL;
    static size_t size = 0;
    if (getline(&line, &size, from_server) < 0) {
        fprintf(stderr, "the server has ended\n");
        exit(1);
    }
    if (strncmp(line, "{\"error\":", 9) == 0) {
        fprintf(stderr, "%s", line);
        exit(1);
    }
    return line;
}

static const char* ask(const char* line) {
    fprintf(to_server, "%s\n", line);
    fflush(to_server);
    return answer();
}

/* What follows a name in a line of JSON; a real client would use a library that reads JSON. */
static const char* value_of(const char* line, const char* name) {
    char key[64];
    snprintf(key, sizeof key, "\"%s\":", name);
    const char* at = strstr(line, key);
    if (at == NULL) {
        fprintf(stderr, "expected a field %s, found none\n", name);
        exit(1);
    }
    return at + strlen(key);
}

int main(int count, char** arguments) {
    if (count != 3) {
        fprintf(stderr, "usage: %s PROGRAM SCENARIO\n", arguments[0]);
        return 2;
    }
    const pid_t child = start(arguments[1], arguments[2]);
    const char* state = answer(); /* before any step */
    for (int k = 0; k < 500 && strncmp(value_of(state, "completed"), "true", 4) != 0; ++k) {
        fprintf(to_server, "advance 2 mm\n"); /* waits for the step and is not answered */
        state = ask("step 2");
        if (k % 10 == 0)
            printf("frame %d: %.1f mm inside, %.1f mm to the target\n", atoi(value_of(state, "frame")),
                   atof(value_of(state, "inserted_mm")), atof(value_of(state, "path_to_target_mm")));
    }
    const int reached = strncmp(value_of(state, "completed"), "true", 4) == 0;
    printf("%s\n", reached ? "target reached" : "target not reached");
    fprintf(to_server, "quit\n");
    fclose(to_server);
    int status = 0;
    waitpid(child, &status, 0);
    return reached && WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0 : 1;
}
