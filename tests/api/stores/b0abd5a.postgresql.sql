-- A store as commit b0abd5a writes it on PostgreSQL (schema 0005): the same as in the file for SQLite.
CREATE TABLE public.alembic_version (
    version_num character varying(32) NOT NULL
);
CREATE TABLE public.campaigns (
    number integer NOT NULL,
    id character varying(32) NOT NULL,
    name text NOT NULL,
    rig text NOT NULL,
    specimen text NOT NULL,
    state character varying(16) NOT NULL,
    reason text NOT NULL,
    abort_reason text,
    created_at_s double precision NOT NULL,
    started_at_s double precision,
    ended_at_s double precision,
    warm_up json,
    asked character varying(16) DEFAULT ''::character varying NOT NULL,
    interlocks json DEFAULT '[]'::json NOT NULL
);
CREATE SEQUENCE public.campaigns_number_seq
    AS integer
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.campaigns_number_seq OWNED BY public.campaigns.number;
CREATE TABLE public.events (
    number integer NOT NULL,
    campaign integer NOT NULL,
    at_s double precision NOT NULL,
    text text NOT NULL
);
CREATE SEQUENCE public.events_number_seq
    AS integer
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.events_number_seq OWNED BY public.events.number;
CREATE TABLE public.explanations (
    number integer NOT NULL,
    id character varying(32) NOT NULL,
    name text NOT NULL,
    campaign character varying(32),
    model json,
    runs json NOT NULL,
    held_out json NOT NULL,
    state character varying(16) NOT NULL,
    phase text NOT NULL,
    done double precision NOT NULL,
    reason text NOT NULL,
    verdict character varying(32) NOT NULL,
    effects json NOT NULL,
    cancel_reason text,
    owner text NOT NULL,
    expires_at_s double precision NOT NULL,
    created_at_s double precision NOT NULL,
    started_at_s double precision,
    ended_at_s double precision
);
CREATE SEQUENCE public.explanations_number_seq
    AS integer
    START WITH 1
    INCREMENT BY 1
    NO MINVALUE
    NO MAXVALUE
    CACHE 1;
ALTER SEQUENCE public.explanations_number_seq OWNED BY public.explanations.number;
CREATE TABLE public.leases (
    rig character varying(512) NOT NULL,
    owner text NOT NULL,
    token integer NOT NULL,
    expires_at_s double precision NOT NULL
);
CREATE TABLE public.runs (
    id character varying(64) NOT NULL,
    campaign integer NOT NULL,
    test text NOT NULL,
    held_out boolean NOT NULL,
    status character varying(16) NOT NULL,
    location text NOT NULL,
    size_bytes integer NOT NULL,
    sha256 character varying(64) NOT NULL,
    samples integer NOT NULL,
    sample_rate_hz double precision NOT NULL,
    created character varying(40) NOT NULL
);
CREATE TABLE public.tests (
    campaign integer NOT NULL,
    "position" integer NOT NULL,
    name text NOT NULL,
    config json NOT NULL,
    held_out boolean NOT NULL,
    duration_s double precision NOT NULL,
    state character varying(16) NOT NULL,
    phase character varying(16) NOT NULL,
    samples integer NOT NULL,
    total_samples integer NOT NULL,
    text text NOT NULL
);
CREATE TABLE public.uploads (
    id character varying(32) NOT NULL,
    name text NOT NULL,
    location text NOT NULL,
    size_bytes integer NOT NULL,
    sha256 character varying(64) NOT NULL,
    specimen text NOT NULL,
    status character varying(16) NOT NULL,
    samples integer NOT NULL,
    sample_rate_hz double precision NOT NULL,
    created_at_s double precision NOT NULL
);
ALTER TABLE ONLY public.campaigns ALTER COLUMN number SET DEFAULT nextval('public.campaigns_number_seq'::regclass);
ALTER TABLE ONLY public.events ALTER COLUMN number SET DEFAULT nextval('public.events_number_seq'::regclass);
ALTER TABLE ONLY public.explanations ALTER COLUMN number SET DEFAULT nextval('public.explanations_number_seq'::regclass);
INSERT INTO public.alembic_version VALUES ('0005');
INSERT INTO public.campaigns VALUES (1, '00000000000000000000000000000001', 'done', 'modbus://127.0.0.1:5020', 'damper 7', 'done', '', NULL, 1700000000.25, 1700000000.75, 1700000002.5, '{"name": "warm-up", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', '', '["force:-8e3:8e3:stop:0.01"]');
INSERT INTO public.campaigns VALUES (2, '00000000000000000000000000000002', 'failed', 'modbus://127.0.0.1:5020', 'damper 7', 'failed', 'test ''slow'': the rig said no', NULL, 1700000002.75, 1700000003, 1700000003.5, NULL, '', '[]');
INSERT INTO public.campaigns VALUES (3, '00000000000000000000000000000003', 'aborted', 'modbus://127.0.0.1:5020', 'damper 7', 'aborted', 'wrong specimen', NULL, 1700000003.75, NULL, 1700000004, NULL, '', '[]');
INSERT INTO public.campaigns VALUES (4, '00000000000000000000000000000004', 'running', 'modbus://127.0.0.1:5020', 'damper 7', 'running', '', NULL, 1700000004.5, 1700000004.75, NULL, NULL, 'hold', '[]');
INSERT INTO public.campaigns VALUES (5, '00000000000000000000000000000005', 'waiting', 'modbus://127.0.0.1:5020', 'damper 7', 'accepted', '', NULL, 1700000005.5, NULL, NULL, NULL, '', '[]');
INSERT INTO public.campaigns VALUES (6, '00000000000000000000000000000006', 'elsewhere', 'modbus://127.0.0.1:5021', 'damper 7', 'accepted', '', NULL, 1700000005.75, NULL, NULL, NULL, '', '[]');
INSERT INTO public.events VALUES (1, 1, 1700000000.25, 'accepted');
INSERT INTO public.events VALUES (2, 1, 1700000000.75, 'taken by host-a:101:aaaaaaaa');
INSERT INTO public.events VALUES (3, 1, 1700000001.25, 'run run-slow of test slow: complete, 500 samples');
INSERT INTO public.events VALUES (4, 1, 1700000001.5, 'test slow: done');
INSERT INTO public.events VALUES (5, 1, 1700000002, 'run run-fast of test fast: complete, 250 samples');
INSERT INTO public.events VALUES (6, 1, 1700000002.25, 'test fast: done');
INSERT INTO public.events VALUES (7, 1, 1700000002.5, 'done');
INSERT INTO public.events VALUES (8, 2, 1700000002.75, 'accepted');
INSERT INTO public.events VALUES (9, 2, 1700000003, 'taken by host-a:101:aaaaaaaa');
INSERT INTO public.events VALUES (10, 2, 1700000003.25, 'test slow: failed: the rig said no');
INSERT INTO public.events VALUES (11, 2, 1700000003.5, 'failed: test ''slow'': the rig said no');
INSERT INTO public.events VALUES (12, 3, 1700000003.75, 'accepted');
INSERT INTO public.events VALUES (13, 3, 1700000004, 'aborted: wrong specimen');
INSERT INTO public.events VALUES (14, 4, 1700000004.5, 'accepted');
INSERT INTO public.events VALUES (15, 4, 1700000004.75, 'taken by host-a:102:bbbbbbbb');
INSERT INTO public.events VALUES (16, 4, 1700000005.25, 'hold asked for: over HTTP');
INSERT INTO public.events VALUES (17, 5, 1700000005.5, 'accepted');
INSERT INTO public.events VALUES (18, 6, 1700000005.75, 'accepted');
INSERT INTO public.explanations VALUES (1, '00000000000000000000000000000007', 'done', '00000000000000000000000000000001', '{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}', '["run-slow"]', '["run-fast"]', 'done', '', 1, '', 'explained', '[["coulomb_friction", 0.97], ["gas_spring", 0.86]]', NULL, 'host-a:102:bbbbbbbb', 1700000026.75, 1700000006.25, 1700000006.5, 1700000007);
INSERT INTO public.explanations VALUES (2, '00000000000000000000000000000008', 'failed', NULL, NULL, '["run-slow"]', '["run-fast"]', 'failed', '', 0, 'run run-slow: the force is reversed', '', '[]', NULL, 'host-a:102:bbbbbbbb', 1700000027.5, 1700000007.25, 1700000007.5, 1700000007.75);
INSERT INTO public.explanations VALUES (3, '00000000000000000000000000000009', 'cancelled', NULL, '{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}', '["run-slow"]', '["run-fast"]', 'cancelled', '', 0, 'a cancellation was asked for over HTTP', '', '[]', NULL, '', 0, 1700000008, NULL, 1700000008.25);
INSERT INTO public.explanations VALUES (4, '0000000000000000000000000000000a', 'running', NULL, '{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}', '["uuuuuuuuuuuuuuuuuuuuuuuuuuuuuuuu"]', '[]', 'running', 'naming', 0.25, '', '', '[]', NULL, 'host-a:102:bbbbbbbb', 1700000029, 1700000008.5, 1700000008.75, NULL);
INSERT INTO public.explanations VALUES (5, '0000000000000000000000000000000b', 'waiting', '00000000000000000000000000000001', '{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}', '["run-slow"]', '["run-fast"]', 'accepted', '', 0, '', '', '[]', NULL, '', 0, 1700000009.25, NULL, NULL);
INSERT INTO public.leases VALUES ('modbus://127.0.0.1:5020', 'host-a:102:bbbbbbbb', 2, 1700000025);
INSERT INTO public.runs VALUES ('run-slow', 1, 'slow', false, 'complete', '00000000000000000000000000000001/slow.h5', 4096, '0000000000000000000000000000000000000000000000000000000000000000', 500, 1000, '2023-11-14T22:00:00+00:00');
INSERT INTO public.runs VALUES ('run-fast', 1, 'fast', true, 'complete', '00000000000000000000000000000001/fast.h5', 4097, '1111111111111111111111111111111111111111111111111111111111111111', 250, 1000, '2023-11-14T22:01:00+00:00');
INSERT INTO public.tests VALUES (1, 0, 'slow', '{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', false, 0.5, 'done', '', 500, 500, '');
INSERT INTO public.tests VALUES (1, 1, 'fast', '{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}', true, 0.25, 'done', '', 250, 250, '');
INSERT INTO public.tests VALUES (2, 0, 'slow', '{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', false, 0.5, 'failed', '', 0, 500, 'the rig said no');
INSERT INTO public.tests VALUES (2, 1, 'fast', '{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}', true, 0.25, 'skipped', '', 0, 250, '');
INSERT INTO public.tests VALUES (3, 0, 'slow', '{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', false, 0.5, 'skipped', '', 0, 500, '');
INSERT INTO public.tests VALUES (3, 1, 'fast', '{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}', true, 0.25, 'skipped', '', 0, 250, '');
INSERT INTO public.tests VALUES (4, 1, 'fast', '{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}', true, 0.25, 'waiting', '', 0, 250, '');
INSERT INTO public.tests VALUES (4, 0, 'slow', '{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', false, 0.5, 'running', 'running', 123, 500, '');
INSERT INTO public.tests VALUES (5, 0, 'slow', '{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', false, 0.5, 'waiting', '', 0, 500, '');
INSERT INTO public.tests VALUES (5, 1, 'fast', '{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}', true, 0.25, 'waiting', '', 0, 250, '');
INSERT INTO public.tests VALUES (6, 0, 'slow', '{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}', false, 0.5, 'waiting', '', 0, 500, '');
INSERT INTO public.tests VALUES (6, 1, 'fast', '{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}', true, 0.25, 'waiting', '', 0, 250, '');
INSERT INTO public.uploads VALUES ('uuuuuuuuuuuuuuuuuuuuuuuuuuuuuuuu', 'front-left_3.h5', 'uploads/uuuuuuuuuuuuuuuuuuuuuuuuuuuuuuuu/front-left_3.h5', 12345, 'ffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff', 'damper 9', 'complete', 4000, 1000, 1700000006);
SELECT pg_catalog.setval('public.campaigns_number_seq', 6, true);
SELECT pg_catalog.setval('public.events_number_seq', 18, true);
SELECT pg_catalog.setval('public.explanations_number_seq', 5, true);
ALTER TABLE ONLY public.alembic_version
    ADD CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num);
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT pk_campaigns PRIMARY KEY (number);
ALTER TABLE ONLY public.events
    ADD CONSTRAINT pk_events PRIMARY KEY (number);
ALTER TABLE ONLY public.explanations
    ADD CONSTRAINT pk_explanations PRIMARY KEY (number);
ALTER TABLE ONLY public.leases
    ADD CONSTRAINT pk_leases PRIMARY KEY (rig);
ALTER TABLE ONLY public.runs
    ADD CONSTRAINT pk_runs PRIMARY KEY (id);
ALTER TABLE ONLY public.tests
    ADD CONSTRAINT pk_tests PRIMARY KEY (campaign, "position");
ALTER TABLE ONLY public.uploads
    ADD CONSTRAINT pk_uploads PRIMARY KEY (id);
ALTER TABLE ONLY public.campaigns
    ADD CONSTRAINT uq_campaigns_id UNIQUE (id);
ALTER TABLE ONLY public.explanations
    ADD CONSTRAINT uq_explanations_id UNIQUE (id);
ALTER TABLE ONLY public.runs
    ADD CONSTRAINT uq_runs_location UNIQUE (location);
ALTER TABLE ONLY public.tests
    ADD CONSTRAINT uq_tests_campaign_name UNIQUE (campaign, name);
CREATE INDEX ix_campaigns_rig_state ON public.campaigns USING btree (rig, state);
CREATE INDEX ix_events_campaign ON public.events USING btree (campaign);
CREATE INDEX ix_explanations_state ON public.explanations USING btree (state);
CREATE INDEX ix_runs_campaign ON public.runs USING btree (campaign);
ALTER TABLE ONLY public.events
    ADD CONSTRAINT fk_events_campaign FOREIGN KEY (campaign) REFERENCES public.campaigns(number) ON DELETE CASCADE;
ALTER TABLE ONLY public.runs
    ADD CONSTRAINT fk_runs_campaign FOREIGN KEY (campaign) REFERENCES public.campaigns(number) ON DELETE CASCADE;
ALTER TABLE ONLY public.tests
    ADD CONSTRAINT fk_tests_campaign FOREIGN KEY (campaign) REFERENCES public.campaigns(number) ON DELETE CASCADE;
