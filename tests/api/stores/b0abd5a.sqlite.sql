-- A store as commit b0abd5a writes it on SQLite (schema 0005): campaigns, runs, leases, an upload, explanations in every state.
BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('0005');
CREATE TABLE campaigns (
	number INTEGER NOT NULL, 
	id VARCHAR(32) NOT NULL, 
	name TEXT NOT NULL, 
	rig TEXT NOT NULL, 
	specimen TEXT NOT NULL, 
	state VARCHAR(16) NOT NULL, 
	reason TEXT NOT NULL, 
	abort_reason TEXT, 
	created_at_s FLOAT NOT NULL, 
	started_at_s FLOAT, 
	ended_at_s FLOAT, warm_up JSON, asked VARCHAR(16) DEFAULT '' NOT NULL, interlocks JSON DEFAULT '[]' NOT NULL, 
	CONSTRAINT pk_campaigns PRIMARY KEY (number), 
	CONSTRAINT uq_campaigns_id UNIQUE (id)
);
INSERT INTO "campaigns" VALUES(1,'00000000000000000000000000000001','done','modbus://127.0.0.1:5020','damper 7','done','',NULL,1700000000.25,1700000000.75,1700000002.5,'{"name": "warm-up", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}','','["force:-8e3:8e3:stop:0.01"]');
INSERT INTO "campaigns" VALUES(2,'00000000000000000000000000000002','failed','modbus://127.0.0.1:5020','damper 7','failed','test ''slow'': the rig said no',NULL,1700000002.75,1700000003.0,1700000003.5,NULL,'','[]');
INSERT INTO "campaigns" VALUES(3,'00000000000000000000000000000003','aborted','modbus://127.0.0.1:5020','damper 7','aborted','wrong specimen',NULL,1700000003.75,NULL,1700000004.0,NULL,'','[]');
INSERT INTO "campaigns" VALUES(4,'00000000000000000000000000000004','running','modbus://127.0.0.1:5020','damper 7','running','',NULL,1700000004.5,1700000004.75,NULL,NULL,'hold','[]');
INSERT INTO "campaigns" VALUES(5,'00000000000000000000000000000005','waiting','modbus://127.0.0.1:5020','damper 7','accepted','',NULL,1700000005.5,NULL,NULL,NULL,'','[]');
INSERT INTO "campaigns" VALUES(6,'00000000000000000000000000000006','elsewhere','modbus://127.0.0.1:5021','damper 7','accepted','',NULL,1700000005.75,NULL,NULL,NULL,'','[]');
CREATE TABLE events (
	number INTEGER NOT NULL, 
	campaign INTEGER NOT NULL, 
	at_s FLOAT NOT NULL, 
	text TEXT NOT NULL, 
	CONSTRAINT pk_events PRIMARY KEY (number), 
	CONSTRAINT fk_events_campaign FOREIGN KEY(campaign) REFERENCES campaigns (number) ON DELETE CASCADE
);
INSERT INTO "events" VALUES(1,1,1700000000.25,'accepted');
INSERT INTO "events" VALUES(2,1,1700000000.75,'taken by host-a:101:aaaaaaaa');
INSERT INTO "events" VALUES(3,1,1700000001.25,'run run-slow of test slow: complete, 500 samples');
INSERT INTO "events" VALUES(4,1,1700000001.5,'test slow: done');
INSERT INTO "events" VALUES(5,1,1700000002.0,'run run-fast of test fast: complete, 250 samples');
INSERT INTO "events" VALUES(6,1,1700000002.25,'test fast: done');
INSERT INTO "events" VALUES(7,1,1700000002.5,'done');
INSERT INTO "events" VALUES(8,2,1700000002.75,'accepted');
INSERT INTO "events" VALUES(9,2,1700000003.0,'taken by host-a:101:aaaaaaaa');
INSERT INTO "events" VALUES(10,2,1700000003.25,'test slow: failed: the rig said no');
INSERT INTO "events" VALUES(11,2,1700000003.5,'failed: test ''slow'': the rig said no');
INSERT INTO "events" VALUES(12,3,1700000003.75,'accepted');
INSERT INTO "events" VALUES(13,3,1700000004.0,'aborted: wrong specimen');
INSERT INTO "events" VALUES(14,4,1700000004.5,'accepted');
INSERT INTO "events" VALUES(15,4,1700000004.75,'taken by host-a:102:bbbbbbbb');
INSERT INTO "events" VALUES(16,4,1700000005.25,'hold asked for: over HTTP');
INSERT INTO "events" VALUES(17,5,1700000005.5,'accepted');
INSERT INTO "events" VALUES(18,6,1700000005.75,'accepted');
CREATE TABLE explanations (
	number INTEGER NOT NULL, 
	id VARCHAR(32) NOT NULL, 
	name TEXT NOT NULL, 
	campaign VARCHAR(32), 
	model JSON, 
	runs JSON NOT NULL, 
	held_out JSON NOT NULL, 
	state VARCHAR(16) NOT NULL, 
	phase TEXT NOT NULL, 
	done FLOAT NOT NULL, 
	reason TEXT NOT NULL, 
	verdict VARCHAR(32) NOT NULL, 
	effects JSON NOT NULL, 
	cancel_reason TEXT, 
	owner TEXT NOT NULL, 
	expires_at_s FLOAT NOT NULL, 
	created_at_s FLOAT NOT NULL, 
	started_at_s FLOAT, 
	ended_at_s FLOAT, 
	CONSTRAINT pk_explanations PRIMARY KEY (number), 
	CONSTRAINT uq_explanations_id UNIQUE (id)
);
INSERT INTO "explanations" VALUES(1,'00000000000000000000000000000007','done','00000000000000000000000000000001','{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}','["run-slow"]','["run-fast"]','done','',1.0,'','explained','[["coulomb_friction", 0.97], ["gas_spring", 0.86]]',NULL,'host-a:102:bbbbbbbb',1700000026.75,1700000006.25,1700000006.5,1700000007.0);
INSERT INTO "explanations" VALUES(2,'00000000000000000000000000000008','failed',NULL,NULL,'["run-slow"]','["run-fast"]','failed','',0.0,'run run-slow: the force is reversed','','[]',NULL,'host-a:102:bbbbbbbb',1700000027.5,1700000007.25,1700000007.5,1700000007.75);
INSERT INTO "explanations" VALUES(3,'00000000000000000000000000000009','cancelled',NULL,'{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}','["run-slow"]','["run-fast"]','cancelled','',0.0,'a cancellation was asked for over HTTP','','[]',NULL,'',0.0,1700000008.0,NULL,1700000008.25);
INSERT INTO "explanations" VALUES(4,'0000000000000000000000000000000a','running',NULL,'{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}','["uuuuuuuuuuuuuuuuuuuuuuuuuuuuuuuu"]','[]','running','naming',0.25,'','','[]',NULL,'host-a:102:bbbbbbbb',1700000029.0,1700000008.5,1700000008.75,NULL);
INSERT INTO "explanations" VALUES(5,'0000000000000000000000000000000b','waiting','00000000000000000000000000000001','{"format": "damper-rig/model", "format_version": 1, "name": "as simulated", "kind": "physical", "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 600.0}}]}}','["run-slow"]','["run-fast"]','accepted','',0.0,'','','[]',NULL,'',0.0,1700000009.25,NULL,NULL);
CREATE TABLE leases (
	rig VARCHAR(512) NOT NULL, 
	owner TEXT NOT NULL, 
	token INTEGER NOT NULL, 
	expires_at_s FLOAT NOT NULL, 
	CONSTRAINT pk_leases PRIMARY KEY (rig)
);
INSERT INTO "leases" VALUES('modbus://127.0.0.1:5020','host-a:102:bbbbbbbb',2,1700000025.0);
CREATE TABLE runs (
	id VARCHAR(64) NOT NULL, 
	campaign INTEGER NOT NULL, 
	test TEXT NOT NULL, 
	held_out BOOLEAN NOT NULL, 
	status VARCHAR(16) NOT NULL, 
	location TEXT NOT NULL, 
	size_bytes INTEGER NOT NULL, 
	sha256 VARCHAR(64) NOT NULL, 
	samples INTEGER NOT NULL, 
	sample_rate_hz FLOAT NOT NULL, 
	created VARCHAR(40) NOT NULL, 
	CONSTRAINT pk_runs PRIMARY KEY (id), 
	CONSTRAINT uq_runs_location UNIQUE (location), 
	CONSTRAINT fk_runs_campaign FOREIGN KEY(campaign) REFERENCES campaigns (number) ON DELETE CASCADE
);
INSERT INTO "runs" VALUES('run-slow',1,'slow',0,'complete','00000000000000000000000000000001/slow.h5',4096,'0000000000000000000000000000000000000000000000000000000000000000',500,1000.0,'2023-11-14T22:00:00+00:00');
INSERT INTO "runs" VALUES('run-fast',1,'fast',1,'complete','00000000000000000000000000000001/fast.h5',4097,'1111111111111111111111111111111111111111111111111111111111111111',250,1000.0,'2023-11-14T22:01:00+00:00');
CREATE TABLE tests (
	campaign INTEGER NOT NULL, 
	position INTEGER NOT NULL, 
	name TEXT NOT NULL, 
	config JSON NOT NULL, 
	held_out BOOLEAN NOT NULL, 
	duration_s FLOAT NOT NULL, 
	state VARCHAR(16) NOT NULL, 
	phase VARCHAR(16) NOT NULL, 
	samples INTEGER NOT NULL, 
	total_samples INTEGER NOT NULL, 
	text TEXT NOT NULL, 
	CONSTRAINT pk_tests PRIMARY KEY (campaign, position), 
	CONSTRAINT uq_tests_campaign_name UNIQUE (campaign, name), 
	CONSTRAINT fk_tests_campaign FOREIGN KEY(campaign) REFERENCES campaigns (number) ON DELETE CASCADE
);
INSERT INTO "tests" VALUES(1,0,'slow','{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}',0,0.5,'done','',500,500,'');
INSERT INTO "tests" VALUES(1,1,'fast','{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}',1,0.25,'done','',250,250,'');
INSERT INTO "tests" VALUES(2,0,'slow','{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}',0,0.5,'failed','',0,500,'the rig said no');
INSERT INTO "tests" VALUES(2,1,'fast','{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}',1,0.25,'skipped','',0,250,'');
INSERT INTO "tests" VALUES(3,0,'slow','{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}',0,0.5,'skipped','',0,500,'');
INSERT INTO "tests" VALUES(3,1,'fast','{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}',1,0.25,'skipped','',0,250,'');
INSERT INTO "tests" VALUES(4,0,'slow','{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}',0,0.5,'running','running',123,500,'');
INSERT INTO "tests" VALUES(4,1,'fast','{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}',1,0.25,'waiting','',0,250,'');
INSERT INTO "tests" VALUES(5,0,'slow','{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}',0,0.5,'waiting','',0,500,'');
INSERT INTO "tests" VALUES(5,1,'fast','{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}',1,0.25,'waiting','',0,250,'');
INSERT INTO "tests" VALUES(6,0,'slow','{"name": "slow", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}',0,0.5,'waiting','',0,500,'');
INSERT INTO "tests" VALUES(6,1,'fast','{"name": "fast", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 8.0, "cycles": 2, "held_out": true, "current": 0.5}',1,0.25,'waiting','',0,250,'');
CREATE TABLE uploads (
	id VARCHAR(32) NOT NULL, 
	name TEXT NOT NULL, 
	location TEXT NOT NULL, 
	size_bytes INTEGER NOT NULL, 
	sha256 VARCHAR(64) NOT NULL, 
	specimen TEXT NOT NULL, 
	status VARCHAR(16) NOT NULL, 
	samples INTEGER NOT NULL, 
	sample_rate_hz FLOAT NOT NULL, 
	created_at_s FLOAT NOT NULL, 
	CONSTRAINT pk_uploads PRIMARY KEY (id)
);
INSERT INTO "uploads" VALUES('uuuuuuuuuuuuuuuuuuuuuuuuuuuuuuuu','front-left_3.h5','uploads/uuuuuuuuuuuuuuuuuuuuuuuuuuuuuuuu/front-left_3.h5',12345,'ffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff','damper 9','complete',4000,1000.0,1700000006.0);
CREATE INDEX ix_campaigns_rig_state ON campaigns (rig, state);
CREATE INDEX ix_runs_campaign ON runs (campaign);
CREATE INDEX ix_events_campaign ON events (campaign);
CREATE INDEX ix_explanations_state ON explanations (state);
COMMIT;
